# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares inverse kinematics with Blender's constraint, alternately in one process: times of a solve,
remaining errors, how smoothly bones move; ik.svg."""

from __future__ import annotations

import time
from pathlib import Path

import bpy
import common
import matplotlib
import numpy as np
from sinew import affine, quat

from future_work import chains, constraints
from future_work.types import Solution

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
BONES = (2, 5, 10)
KINDS = ("free", "limited")
CHAINS = 100
FRAMES = 120
# Names in times() and in animated(), and those in the picture.
SOLVERS = (("blender", "blender", "Blender"), ("sinew 1e-06", "sinew", "Sinew"))


def make_chains(bones: int, kind: str, count: int) -> tuple[bpy.types.Object, list]:
    """An armature of `count` chains side by side, each bent a little, with a constraint and a target."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    armature = bpy.data.objects.new("Chains", bpy.data.armatures.new("Chains"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    for chain in range(count):
        parent = None
        for number in range(bones):
            bone = armature.data.edit_bones.new(f"{chain}.{number}")
            bone.head = (3.0 * bones * chain, 0.0, number) if parent is None else parent.tail
            bone.tail = (bone.head.x, bone.head.y, number + 1.0)
            bone.parent, bone.use_connect = parent, parent is not None
            parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    targets = []
    for chain in range(count):
        target = bpy.data.objects.new(f"Target.{chain}", None)
        bpy.context.scene.collection.objects.link(target)
        constraint = armature.pose.bones[f"{chain}.{bones - 1}"].constraints.new("IK")
        constraint.target, constraint.chain_count = target, bones
        targets.append(target)
    for bone in armature.pose.bones:
        bone.rotation_mode = "XYZ"
        bone.rotation_euler = (0.3, 0.0, 0.0)
        if kind == "limited" and bone.parent is not None:
            bone.lock_ik_y = True
            for axis, least, largest in (("x", -0.2, 2.5), ("z", -0.5, 0.5)):
                setattr(bone, f"use_ik_limit_{axis}", True)
                setattr(bone, f"ik_min_{axis}", least)
                setattr(bone, f"ik_max_{axis}", largest)
    return armature, targets


def angular_acceleration(matrices: np.ndarray) -> float:
    """Root mean square over frames and bones of the second difference of rotations, radians per frame
    squared; matrices [frames, bones, 4, 4]."""
    rotations = affine.to_quat_vec(affine.normalized(matrices.astype(float)))[..., :4]
    steps = quat.to_rotation_vector(quat.compose(rotations[1:], quat.conjugate(rotations[:-1])))
    return float(np.sqrt((np.diff(steps, axis=0) ** 2).sum(axis=-1).mean()))


def place_targets(targets: list, bones: int, rng: np.random.Generator) -> None:
    for chain, target in enumerate(targets):
        towards = rng.normal(size=3)
        towards *= rng.uniform(0.3, 0.95) * bones / np.linalg.norm(towards)
        target.location = towards + np.array([3.0 * bones * chain, 0.0, 0.0])


def times(bones: int, kind: str, seconds: float) -> dict:
    """{solver: microseconds per solve, and remaining errors}. Blender's time is an update of the armature
    with the constraints, minus one without; Sinew solves the same chains in one call. Processor time of
    all threads, on which other programs have little influence."""
    armature, targets = make_chains(bones, kind, CHAINS)
    place_targets(targets, bones, np.random.default_rng(bones))
    bpy.context.view_layer.update()
    trees = constraints.read_trees(armature)
    theirs = np.stack([constraints.read_posed(armature, tree).bones for tree in trees]).astype(float)
    names = [pair for tree in trees for pair in tree.constraints]
    constraints.set_muted(armature, names, True)
    bpy.context.view_layer.update()
    # All trees have the same bones and limits, so they can be solved like frames of one tree.
    problem = chains.problem_of(
        trees[0], chains.stack([constraints.read_posed(armature, tree) for tree in trees])
    )
    solver = trees[0].solver()

    def update() -> float:
        bpy.context.view_layer.update()
        began = time.process_time()
        for _ in range(3):
            armature.update_tag(refresh={"DATA"})
            bpy.context.view_layer.update()
        return (time.process_time() - began) / 3

    def solve(tolerance: float) -> Solution:
        return solver.solve(
            problem.rest,
            problem.tips,
            problem.goals,
            rotations=problem.rotations,
            root=problem.root,
            tolerance=tolerance,
            iterations=chains.ITERATIONS,
        )

    tolerances = (1e-3, 1e-6)
    taken: dict[str, list[float]] = {"blender": [], **{f"sinew {t:g}": [] for t in tolerances}}
    with_it, without = [], []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(taken["blender"]) < 5:
        constraints.set_muted(armature, names, False)
        with_it.append(update() / CHAINS)
        constraints.set_muted(armature, names, True)
        without.append(update() / CHAINS)
        taken["blender"].append(with_it[-1] - without[-1])
        for tolerance in tolerances:
            began = time.process_time()
            solve(tolerance)
            taken[f"sinew {tolerance:g}"].append((time.process_time() - began) / CHAINS)
    found = {}
    for name, turns in taken.items():
        low, median, high = np.percentile(turns, [25, 50, 75]) * 1e6
        if name == "blender":
            errors, iterations, least = (
                chains.tip_errors(trees[0], problem, theirs),
                None,
                min(with_it) - min(without),
            )
        else:
            solution = solve(float(name.split()[1]))
            matrices = chains.matrices_of(trees[0], problem, solution.rotations)
            errors = chains.tip_errors(trees[0], problem, matrices)
            iterations, least = float(np.mean(solution.iterations)), min(turns)
        found[name] = {
            "median": median,
            "quartiles": [low, high],
            "least": least * 1e6,
            "turns": len(turns),
            "error median": float(np.median(errors)),
            "error max": float(np.max(errors)),
            "reached to 1e-3": int((errors < 1e-3).sum()),
            "iterations": iterations,
        }
    return found


def animated(bones: int, kind: str) -> dict:
    """{solver: errors of frames, angular acceleration} with a target on a smooth curve within reach."""
    armature, (target,) = make_chains(bones, kind, 1)
    tree = constraints.read_trees(armature)[0]
    theirs, posed = [], []
    for frames, mute in ((theirs, False), (posed, True)):
        constraints.set_muted(armature, tree.constraints, mute)
        for frame in range(FRAMES):
            phase = 2.0 * np.pi * frame / FRAMES
            target.location = bones * np.array(
                [0.45 * np.sin(2 * phase), 0.35 * np.cos(phase) + 0.2, 0.5 + 0.25 * np.sin(phase)]
            )
            bpy.context.view_layer.update()
            frames.append(constraints.read_posed(armature, tree))
    problem = chains.problem_of(tree, chains.stack(posed))
    matrices = {"blender": chains.stack(theirs).bones.astype(float)}
    matrices["sinew"] = chains.matrices_of(tree, problem, chains.solve(tree, problem).rotations)
    return {
        solver: {
            "errors": chains.tip_errors(tree, problem, of).tolist(),
            "acceleration": angular_acceleration(of),
        }
        for solver, of in matrices.items()
    }


def draw(spreads: dict, motions: dict) -> None:
    figure, (first, second, third) = plt.subplots(1, 3, figsize=(12.6, 3.6), layout="constrained")
    styles = (("#ee6677", "^"), ("#4477aa", "o"))
    for (name, solver, text), (colour, marker) in zip(SOLVERS, styles, strict=True):
        for kind, line in zip(KINDS, ("-", ":"), strict=True):
            values = [spreads[f"{bones} {kind}"][name]["median"] for bones in BONES]
            first.loglog(BONES, values, line, color=colour, marker=marker)
        for axes in (first, third):
            axes.plot([], [], color=colour, marker=marker, label=text)
        errors = np.maximum(motions["5 free"][solver]["errors"], 1e-12)
        second.semilogy(errors, color=colour, label=text)
        for kind, line in zip(KINDS, ("-", ":"), strict=True):
            values = [motions[f"{bones} {kind}"][solver]["acceleration"] for bones in BONES]
            third.loglog(BONES, values, line, color=colour, marker=marker)
    first.set(xlabel="bones", ylabel="microseconds a solve", title="Time (dotted: with limits)")
    second.set(xlabel="frame", ylabel="distance to the goal, chain's lengths", title="What is left, 5 bones")
    third.set(xlabel="bones", ylabel="rms, radians per frame²", title="Angular acceleration")
    for axes in (first, third):
        axes.set_xticks(BONES, [str(bones) for bones in BONES])
        axes.minorticks_off()
    for axes in (first, second, third):
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(HERE / "ik.svg", metadata={"Date": None})


def main() -> None:
    arguments = common.options(__doc__, "ik", "shorter runs, no picture").parse_args()
    plt.rcParams["svg.hashsalt"] = "sinew"
    facts = common.begin("inverse kinematics", blender=bpy.app.version_string)
    spreads, motions = {}, {}
    columns = ("bones", "solver", "us, least", "median", "quartiles", "", "median left", "most left")
    columns += ("to 1e-3", "steps")
    print("".join(f"{column:>12}" for column in columns))
    for bones in BONES:
        for kind in KINDS:
            key = f"{bones} {kind}"
            spreads[key] = times(bones, kind, 0.5 if arguments.quick else 8.0)
            motions[key] = animated(bones, kind)
            for name, of in spreads[key].items():
                cells = [key, name, *(f"{n:.1f}" for n in (of["least"], of["median"], *of["quartiles"]))]
                cells += [f"{of['error median']:.1e}", f"{of['error max']:.1e}", f"{of['reached to 1e-3']} %"]
                cells.append("-" if of["iterations"] is None else f"{of['iterations']:.1f}")
                print("".join(f"{cell:>12}" for cell in cells), flush=True)
    print("\nrms of angular acceleration, and the largest error, over an animated target")
    for key, of in motions.items():
        texts = (f"{name}: {m['acceleration']:.4f} {max(m['errors']):.1e}  " for name, m in of.items())
        print(f"{key:12}", *texts)
    common.write(arguments.name, machine=facts, microseconds=spreads, animated=motions)
    if not arguments.quick:
        draw(spreads, motions)


if __name__ == "__main__":
    with common.registered():
        main()
