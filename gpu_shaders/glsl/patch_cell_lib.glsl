/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cells of patches: which one a hit lies in, and the table that tells which patch a cell has. Reference:
 * core/patches.py.
 *
 * A cell's key is (place x, y, z; number of sheet, level, facing and variant), whole numbers that floats hold exactly.
 *
 * The table has open addresses: an entry of `table` is 0 (free), the number of a patch + 1, or CLAIM + the number of a
 * hit of the bind in hand whose cell has no patch yet. Which hit claims an entry first depends on the driver; which
 * patch a cell gets does not: its leader is the lowest hit (`leaders`), and patches are numbered in the order of their
 * leaders.
 */

const uint CLAIM = 0x80000000u;
const float NO_PATCH = -1.0, NOTHING = -2.0, PENDING = -3.0; /* in place of a patch */
const int VARIANT_COUNT = 4;
const float LEVELS_AND_FACINGS = 1728.0; /* 64 levels, 27 facings */

uint cell_hash(vec4 key)
{
  uvec4 v = uvec4(ivec4(key));
  return pcg3d(v.xyz + v.w * uvec3(0x9E3779B1u, 0x85EBCA6Bu, 0xC2B2AE35u)).x;
}

#ifdef CELL_TABLE
/* Key of the cell that owns an entry of the table. */
vec4 owner_key(uint owner, int variant)
{
  if ((owner & CLAIM) != 0u) {
    vec4 key = element(hit_keys, int(owner & ~CLAIM));
    return vec4(key.xyz, key.w * float(VARIANT_COUNT) + float(variant));
  }
  return element(patch_keys, int(owner) - 1);
}
#endif
