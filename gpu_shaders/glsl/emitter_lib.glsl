/* Emissive triangles sampled as lights; which ones and why: core/emitters.py.
 *
 * emitters, 1 element each: triangle, upper end of its share of the total power, probability density per m².
 * The candidate that is traced is chosen by resampling (Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR
 * 2005): CANDIDATES points by power, one of them by what it would send here if nothing stood between.
 */

const int CANDIDATES = 8;

struct EmitterSample {
  vec3 point;
  vec3 normal;
  vec3 radiance;
  float density; /* per m² */
};

int find_emitter(float u)
{
  int low = 0, high = emitter_count - 1;
  while (low < high) {
    int middle = (low + high) / 2;
    if (element(emitters, middle).y <= u) {
      low = middle + 1;
    }
    else {
      high = middle;
    }
  }
  return low;
}

EmitterSample sample_emitter(vec3 u)
{
  EmitterSample chosen;
  vec4 emitter = element(emitters, find_emitter(u.z));
  int triangle = int(emitter.x);
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec3 ab = element(triangle_corners, 3 * triangle + 1).xyz - a;
  vec3 ac = element(triangle_corners, 3 * triangle + 2).xyz - a;
  float root = sqrt(u.x);
  vec2 barycentric = vec2(root * (1.0 - u.y), root * u.y);
  chosen.point = a + ab * barycentric.x + ac * barycentric.y;
  chosen.normal = normalize(cross(ab, ac));
  chosen.density = emitter.z;
  vec4 emission = element(materials, 3 * int(element(triangle_attributes, 5 * triangle).w) + 1);
  chosen.radiance = emission.rgb;
#ifdef HAS_IMAGES
  if (emission.w >= 0.0) {
    chosen.radiance *= sample_image(int(emission.w), triangle_uv(triangle, barycentric), 0.0).rgb;
  }
#endif
#ifdef HAS_ALPHA
  if (is_hole(triangle, barycentric)) {
    chosen.radiance = vec3(0.0);
  }
#endif
  return chosen;
}

/* Irradiance of all sampled emitters at a surface, one shadow ray: sample `index` of the sequence of `key`. */
vec3 emitter_irradiance(vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  vec3 best_irradiance = vec3(0.0), best_direction = vec3(0.0);
  float best_distance = 0.0, best_weight = 0.0, total = 0.0;
  float choice = sample_r3(key + uvec3(0x68E31DA4u, 0u, 0u), index).x;
  for (int i = 0; i < CANDIDATES; i++) {
    EmitterSample emitter = sample_emitter(sample_r3(key, index * CANDIDATES + i));
    vec3 offset = emitter.point - point;
    float squared = max(dot(offset, offset), 1.0e-20);
    float distance = sqrt(squared);
    vec3 direction = offset / distance;
    float cosines = max(dot(direction, normal), 0.0) * abs(dot(direction, emitter.normal));
    vec3 irradiance = emitter.radiance * (cosines / (squared * emitter.density));
    /* no uniform emitter gives more than π·L: near a lamp the estimate is bounded by what is possible */
    irradiance = min(irradiance, emitter.radiance * (3.141592653589793 * float(CANDIDATES)));
    float weight = irradiance.r + irradiance.g + irradiance.b;
    total += weight;
    /* one number chooses among all candidates: what is left of it is spread over 0..1 again */
    if (weight > 0.0 && choice * total < weight) {
      choice = choice * total / weight;
      best_irradiance = irradiance;
      best_direction = direction;
      best_distance = distance;
      best_weight = weight;
    }
    else if (total > weight) {
      choice = (choice * total - weight) / (total - weight);
    }
  }
  if (best_weight == 0.0 || trace_any(origin, best_direction, best_distance * 0.9999)) {
    return vec3(0.0);
  }
  return best_irradiance * (total / (best_weight * float(CANDIDATES)));
}
