/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How fast the device multiplies and adds: 4 independent vec4 a thread, 32 operations each of `rounds`, one store at
 * the end.
 *
 * Dispatch: one thread a texel; groups of 16×16. `factor` must be unknown to the compiler.
 */

void main()
{
  vec4 seed = vec4(gl_GlobalInvocationID.xyxy) * factor;
  vec4 a = seed, b = seed + 1.0, c = seed + 2.0, d = seed + 3.0;
  for (int round = 0; round < rounds; round++) {
    a = a * factor + seed;
    b = b * factor + seed;
    c = c * factor + seed;
    d = d * factor + seed;
  }
  imageStore(to_texels, ivec2(gl_GlobalInvocationID.xy), a + b + c + d);
}
