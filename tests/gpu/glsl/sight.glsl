/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Does each of `hits` see the leader beside it? */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    imageStore(result, element_position(i), vec4(sees(element(hits, i), element(leaders, i)) ? 1.0 : 0.0));
  }
}
