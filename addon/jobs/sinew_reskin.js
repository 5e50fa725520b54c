// SPDX-License-Identifier: GPL-3.0-or-later
// A job type for Flamenco 3.5 and newer: checks the .blend files of a folder, writes copies that Sinew deforms, and
// checks that the farm's Blender can render these; or bends every joint. docs/flamenco.md is its manual.

const ACTIONS = ["re-skin", "check", "flex"];
// Where a worker has Sinew: as the extension of its Blender, or as the package sinew-blender, which a variable
// `sinew` of the Manager names.
const PROGRAMS = {
    "extension": { exe: "{blender}", args: ["--command", "sinew"] },
    "package": { exe: "{sinew}", args: [] },
};
// As `sinew methods` lists them; ./dev stub writes them.
const METHODS = ["lbs", "dq", "cor", "ddm", "sdef", "qv", "sbs", "log", "dib"];

// Runs where the job is submitted. Names have `/` between folders on every system, and end at the line: the Manager
// changes the beginning of a path to a variable of its own, which it would do to the first name alone, were they whole.
const FILES_BELOW = "'\\n'.join(path.relative_to(folder).as_posix() for folder in [abspath(settings.folder)] "
    + "for path in sorted(folder.rglob('*.blend')))";

const JOB_TYPE = {
    label: "Sinew: Check and Re-Skin",
    settings: [
        { key: "action", type: "string", choices: ACTIONS, default: ACTIONS[0],
          description: "Write copies that Sinew deforms, only check whether the files can be rendered, or bend every "
              + "joint" },
        { key: "folder", type: "string", subtype: "dir_path", required: true, visible: "submission",
          description: "All .blend files below this folder; workers see it under the same path" },
        { key: "method", type: "string", choices: METHODS, default: "dq",
          description: "How meshes are deformed" },
        { key: "out", label: "Folder of Copies", type: "string", subtype: "dir_path", visible: "submission",
          description: "Folder for the copies, outside of the folder of the files" },
        { key: "chunk_size", label: "Files per Task", type: "int32", default: 4, propargs: { min: 1 },
          visible: "submission", description: "Number of files that one task does" },
        { key: "options", type: "string", default: "", visible: "submission",
          description: "More options of sinew reskin or sinew flex, such as --set mix=dq --no-pictures" },
        { key: "program", type: "string", choices: Object.keys(PROGRAMS), default: "extension",
          visible: "submission", description: "Where workers have Sinew: as the extension of their Blender, or as "
              + "the package sinew-blender, at the path of the variable sinew" },
        { key: "files", type: "string", required: true, eval: FILES_BELOW, visible: "web",
          description: "The files, one a line, below the folder" },
    ]
};

function compileJob(job) {
    const settings = job.settings;
    const action = settings.action || ACTIONS[0], writes = action === "re-skin";
    const more = settings.options ? shellSplit(settings.options) : [];
    if (writes) checkOut(settings);
    for (const part of partsOf(settings)) {
        if (action === "flex") {
            const flex = author.Task(`flex ${part.name}`, "blender");
            flex.addCommand(sinew(settings, ["flex", ...part.files, ...more]));
            job.addTask(flex);
            continue;
        }
        const check = author.Task(`check ${part.name}`, "blender");
        check.addCommand(sinew(settings, ["check", ...part.files]));
        job.addTask(check);
        if (!writes) continue;

        const out = path.join(settings.out, part.name);
        const reskin = author.Task(`re-skin ${part.name}`, "blender");
        // A task that Flamenco tries again does what is missing.
        const options = ["--method", settings.method || "dq", "--out", out, "--resume"];
        reskin.addCommand(sinew(settings, ["reskin", ...part.files, ...options, ...more]));
        // In the Blender that will render.
        reskin.addCommand(sinew({ program: "extension" }, ["check", out]));
        reskin.addDependency(check);
        job.addTask(reskin);
    }
}

function sinew(settings, words) {
    const program = PROGRAMS[settings.program || "extension"];
    return author.Command("exec", { exe: program.exe, args: [...program.args, ...words] });
}

function checkOut(settings) {
    if (!settings.out) throw new Error("There is no folder for the copies: set Folder of Copies.");
    const folder = withSlash(settings.folder), out = withSlash(settings.out);
    if (out.startsWith(folder)) {
        throw new Error("The folder for the copies is within the folder of the files: choose one outside of it.");
    }
}

function withSlash(folder) {
    return folder.replace(/\\/g, "/").replace(/\/*$/, "/");
}

// What each task does: {name, files}. One of files in one folder only, as two with the same name can not be copied
// into one; its name is also that of the folder of its copies, which no two tasks may share.
function partsOf(settings) {
    const byFolder = new Map();
    for (const file of settings.files.split("\n").filter(line => line !== "")) {
        const folder = file.substring(0, file.lastIndexOf("/") + 1);
        if (!byFolder.has(folder)) byFolder.set(folder, []);
        byFolder.get(folder).push(path.join(settings.folder, file));
    }
    if (byFolder.size === 0) throw new Error(`There is no .blend file below ${settings.folder}.`);
    const parts = [];
    const most = Math.max(1, settings.chunk_size || 4);
    for (const [folder, files] of byFolder) {
        for (let first = 0; first < files.length; first += most) {
            const number = `${1 + first / most}`.padStart(3, "0");
            parts.push({ name: `${folder}part-${number}`, files: files.slice(first, first + most) });
        }
    }
    return parts;
}
