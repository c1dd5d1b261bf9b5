/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One number for a range of patches: the sum of the first channel of `values`, or with LARGEST the largest of its
 * colours after adding those of `others`.
 *
 * Dispatch: one group of THREADS; fixed order of summation. Writes element `result` of `results`.
 */

SHARED_ float partial[THREADS];

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  float reduced = 0.0;
  for (int i = first + lane; i < stop; i += THREADS) {
#ifdef LARGEST
    vec3 color = abs(element(values, i).rgb + element(others, i).rgb);
    float value = max(color.r, max(color.g, color.b));
    reduced = value > reduced || isnan(value) ? value : reduced;
#else
    reduced += element(values, i).x;
#endif
  }
  partial[lane] = reduced;
  barrier();
  for (int half_count = THREADS / 2; half_count > 0; half_count /= 2) {
    if (lane < half_count) {
#ifdef LARGEST
      float value = partial[lane + half_count];
      partial[lane] = value > partial[lane] || isnan(value) ? value : partial[lane];
#else
      partial[lane] += partial[lane + half_count];
#endif
    }
    barrier();
  }
  if (lane == 0) {
    imageStore(results, element_position(result), vec4(partial[0]));
  }
}
