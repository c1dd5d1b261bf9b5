/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Enters patches that are known in an empty table.
 *
 * Dispatch: one thread a patch; groups of 64.
 */

void main()
{
  int patch_index = LINEAR_THREAD;
  if (patch_index >= patch_count) {
    return;
  }
  int slot = int(cell_hash(element(patch_keys, patch_index)) & uint(table_mask));
  for (int step = 0; step <= table_mask; step++) {
    if (imageAtomicCompSwap(table, element_position(slot), 0u, uint(patch_index + 1)) == 0u) {
      return;
    }
    slot = (slot + 1) & table_mask;
  }
}
