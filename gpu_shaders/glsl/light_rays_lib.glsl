/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shadow rays to all lights of a place: lamps, and points on sampled emitters. */

int light_rays()
{
#ifdef HAS_EMITTERS
  return lamp_rays() + 1;
#else
  return lamp_rays();
#endif
}

/* One of them: sample `index` of the sequences of the keys. */
ShadowRay light_ray(
    int number, vec3 point, vec3 origin, vec3 normal, uvec3 lamp_key, uvec3 emitter_key, int index)
{
#ifdef HAS_EMITTERS
  if (number == lamp_rays()) {
    return ray_to_emitters(point, origin, normal, emitter_key, index);
  }
#endif
  return lamp_ray(number, point, origin, normal, lamp_key, index);
}
