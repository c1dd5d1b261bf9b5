/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Image lookups: uv and footprint in places. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec4 place = element(places, i);
    imageStore(result, element_position(i), sample_image(int(place.w), place.xy, place.z));
  }
}
