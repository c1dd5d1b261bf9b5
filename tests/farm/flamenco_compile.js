// SPDX-License-Identifier: GPL-3.0-or-later
/* Compiles a job with a stub of Flamenco's author API and prints its tasks as JSON: node flamenco_compile.js SCRIPT SETTINGS.
 * Settings that the script declares get their defaults, as Flamenco does it; what is missing or unknown is refused. */

const fs = require("fs");
const vm = require("vm");

const [script, text] = process.argv.slice(2);

class Task {
  constructor(name, type) {
    Object.assign(this, { name, type, commands: [], dependencies: [] });
  }
  addCommand(command) {
    this.commands.push(command);
  }
  addDependency(task) {
    if (!(task instanceof Task)) throw new TypeError("a dependency is a task");
    this.dependencies.push(task);
  }
}

const author = {
  Task: (name, type) => new Task(name, type),
  Command: (name, parameters) => ({ name, parameters }),
};
const context = vm.createContext({ author, print: console.error });
vm.runInContext(fs.readFileSync(script, "utf8") + "\nthis.JOB_TYPE = JOB_TYPE;", context);

const given = JSON.parse(text);
const settings = {};
for (const declared of context.JOB_TYPE.settings) {
  settings[declared.key] = declared.key in given ? given[declared.key] : declared.default;
  if (settings[declared.key] === undefined) throw new Error(`setting ${declared.key} is required`);
  delete given[declared.key];
}
if (Object.keys(given).length) throw new Error(`unknown settings ${Object.keys(given)}`);

const tasks = [];
context.compileJob({ settings, addTask: (task) => tasks.push(task) });
console.log(
  JSON.stringify(
    tasks.map((task) => ({
      name: task.name,
      type: task.type,
      commands: task.commands,
      dependencies: task.dependencies.map((other) => tasks.indexOf(other)),
    })),
  ),
);
