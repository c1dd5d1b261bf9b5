// SPDX-License-Identifier: GPL-3.0-or-later
/* Flamenco job type: a Gridlight bake as tasks.
 *
 *   plan ──► iteration 0, share 0 … N−1 ──► merge votes ──► iteration 1, share 0 … N−1 ──► merge
 *
 * Every task is one command line of the launcher and idempotent, so Flamenco may repeat any of them. How many shards the plan
 * has is not known when tasks are made: each task does its share of them, which may be none. Workers need a GPU of one
 * kind, the launcher under the same path, and the job's folder on shared storage.
 */

const JOB_TYPE = {
  label: "Gridlight Bake",
  description: "Bakes a grid of light probes in shards",
  settings: [
    { key: "blendfile", type: "string", required: true, subtype: "file_path", visible: "web", eval: "bpy.data.filepath",
      description: "Path of the .blend to bake" },
    { key: "job_folder", type: "string", required: true, subtype: "dir_path", visible: "submission",
      description: "Folder for plan, shards and result, on shared storage" },
    { key: "launcher", type: "string", default: "gridlight", visible: "submission",
      description: "Path of Gridlight's launcher on the workers" },
    { key: "tasks", type: "int32", default: 8, visible: "submission",
      description: "Tasks per iteration; about four for each worker" },
    { key: "frames", type: "string", default: "", visible: "submission",
      description: "Frames A-B for an animation; empty: the file's current frame" },
    { key: "options", type: "string", default: "", visible: "submission",
      description: "Further options of 'gridlight farm plan', separated by blanks" },
  ],
};

function compileJob(job) {
  const settings = job.settings;
  const count = Math.max(1, settings.tasks);
  const words = settings.options.split(/\s+/).filter((word) => word.length > 0);
  const frames = settings.frames ? ["--frames", settings.frames] : [];

  const plan = task(settings, "plan", ["plan", settings.blendfile, "-o", settings.job_folder, ...frames, ...words], []);
  const votes = shares(settings, count, 0, [plan]);
  const verdict = task(settings, "merge votes", ["merge", settings.job_folder, "--iteration", "0"], votes);
  const light = shares(settings, count, 1, [verdict]);
  const merge = task(settings, "merge", ["merge", settings.job_folder], light);

  for (const each of [plan, ...votes, verdict, ...light, merge]) {
    job.addTask(each);
  }
}

function shares(settings, count, iteration, after) {
  const tasks = [];
  for (let share = 0; share < count; share++) {
    const words = ["shard", settings.job_folder, "--iteration", `${iteration}`, "--shard", `${share}/${count}`];
    tasks.push(task(settings, `iteration-${iteration}-share-${share}`, words, after));
  }
  return tasks;
}

function task(settings, name, words, after) {
  const made = author.Task(name, "misc");
  made.addCommand(author.Command("exec", { exe: settings.launcher, args: ["farm", ...words] }));
  for (const before of after) {
    made.addDependency(before);
  }
  return made;
}
