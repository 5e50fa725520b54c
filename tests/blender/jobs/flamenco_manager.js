// SPDX-License-Identifier: GPL-3.0-or-later
// What a job type sees of Flamenco's Manager, for node: reads {"settings": ...} from standard input, compiles the job
// by the script that is named, prints its job type and its tasks. As in the Manager, a task is copied into its job
// when it is added, `author` refuses tasks without a name or a type, and paths have either slash
// (internal/manager/job_compilers in Flamenco's sources).
"use strict";
const fs = require("fs");
const vm = require("vm");

class Task {
    constructor(name, type) {
        if (!name.trim() || !type.trim()) throw new Error("author.Task(name, type): both are required");
        Object.assign(this, { name: name.trim(), type: type.trim(), commands: [], dependencies: [] });
    }
    addCommand(command) { this.commands.push(command); }
    addDependency(task) { this.dependencies.push(task.name); }
}

function join(...parts) {
    const separator = parts[0].includes("\\") ? "\\" : "/";
    return parts.map((part, i) => i ? part.replace(/^[\\/]+/, "") : part).map(part => part.replace(/[\\/]+$/, ""))
        .join(separator).replace(/[\\/]/g, separator);
}

// Words and quotes alone, of what the Manager's takes.
function shellSplit(text) {
    return [...text.matchAll(/'([^']*)'|"([^"]*)"|(\S+)/g)].map(match => match[1] ?? match[2] ?? match[3]);
}

const tasks = [];
const job = {
    settings: JSON.parse(fs.readFileSync(0, "utf8")).settings,
    addTask(task) { tasks.push(JSON.parse(JSON.stringify(task))); },
};
const author = {
    Task: (name, type) => new Task(name, type),
    Command: (name, parameters) => ({ name, parameters }),
};
const context = vm.createContext({ author, path: { join }, shellSplit, print() {}, given: job });
vm.runInContext(fs.readFileSync(process.argv[2], "utf8"), context);
try {
    vm.runInContext("compileJob(given)", context);
    console.log(JSON.stringify({ tasks, type: vm.runInContext("JOB_TYPE", context) }));
} catch (error) {
    console.log(JSON.stringify({ error: error.message }));
}
