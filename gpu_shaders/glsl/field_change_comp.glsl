/* How far iterations are apart: sums over active probes of the last three fields.
 *
 * Dispatch: one group of 256 threads; fixed order of summation. Writes one texel: |new|², |new − old|²,
 * (new − old)·(old − older), luminance of band 0.
 */

SHARED_ vec4 partial_sums[256];

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  vec4 sum = vec4(0.0);
  int total = slot_count * COEFFICIENTS;
  for (int i = lane; i < total; i += 256) {
    int slot = i / COEFFICIENTS;
    int c = i - slot * COEFFICIENTS;
    int at = int(element(probe_slots, slot).w) * COEFFICIENTS + c;
    vec3 fresh = element(field_new, at).rgb;
    vec3 old = element(field_old, at).rgb;
    vec3 change = fresh - old;
    vec3 last_change = old - element(field_older, at).rgb;
    sum += vec4(dot(fresh, fresh), dot(change, change), dot(change, last_change), c == 0 ? dot(fresh, vec3(0.2126, 0.7152, 0.0722)) : 0.0);
  }
  partial_sums[lane] = sum;
  barrier();
  for (int half_count = 128; half_count > 0; half_count /= 2) {
    if (lane < half_count) {
      partial_sums[lane] += partial_sums[lane + half_count];
    }
    barrier();
  }
  if (lane == 0) {
    imageStore(change, ivec2(0), partial_sums[0]);
  }
}
