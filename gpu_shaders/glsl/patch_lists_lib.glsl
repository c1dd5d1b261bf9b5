/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lists of patches that get direct light, up to LISTS of them: entries list_first … list_first + list_count of
 * `patches` get list_samples samples each, in runs of samples_each, a thread a run. patch_direct_comp and
 * patch_mean_comp walk them in the same order.
 */

const int LISTS = 4;

int runs_of(int list)
{
  return (list_samples[list] + samples_each - 1) / samples_each;
}

struct Entry {
  int list;  /* LISTS past the end */
  int place; /* among the entries of its list */
  int run;   /* of the entry */
  int sums;  /* the thread that takes the entry's first run */
};

/* What a thread takes: of one thread a run. */
Entry entry_of_run(int thread_number)
{
  Entry entry = Entry(0, 0, 0, 0);
  for (int base = 0; entry.list < LISTS; entry.list++) {
    int runs = runs_of(entry.list);
    int stop = base + list_count[entry.list] * runs;
    if (thread_number < stop) {
      entry.place = (thread_number - base) / runs;
      entry.sums = base + entry.place * runs;
      entry.run = thread_number - entry.sums;
      break;
    }
    base = stop;
  }
  return entry;
}

/* The same of one thread an entry. */
Entry entry_of_thread(int thread_number)
{
  Entry entry = Entry(0, thread_number, 0, 0);
  for (; entry.list < LISTS; entry.list++) {
    int count = list_count[entry.list];
    if (entry.place < count) {
      entry.sums += entry.place * runs_of(entry.list);
      break;
    }
    entry.place -= count;
    entry.sums += count * runs_of(entry.list);
  }
  return entry;
}

/* Number of the patch of an entry. */
int patch_of(Entry entry)
{
  return int(element(patches, list_first[entry.list] + entry.place).x);
}
