// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

namespace sinew {

/// The kind of value that a parameter has.
enum class ParameterKind {
    number,        // float
    integer,       // int
    boolean,       // bool
    choice,        // one of Parameter::choices
    vertex_group,  // float32 [vertices]: a weight for each vertex
    method,        // the name of a method
};

/// The name of a kind, for programs: "float", "int", "bool", "enum", "vertex_group", "method".
[[nodiscard]] constexpr std::string_view name_of(ParameterKind kind) noexcept {
    constexpr std::string_view kNames[] = {"float", "int", "bool", "enum", "vertex_group", "method"};
    return kNames[static_cast<std::size_t>(kind)];
}

/// Whether parameters of this kind use Parameter::initial, minimum and maximum.
[[nodiscard]] constexpr bool is_numeric(ParameterKind kind) noexcept {
    return kind == ParameterKind::number || kind == ParameterKind::integer || kind == ParameterKind::boolean;
}

/// A setting of a method or of a stage.
struct Parameter {
    std::string_view id;           // the name in programs
    std::string_view label;        // the name in the interface
    std::string_view description;  // one sentence
    std::string_view unit;         // "", "length", "angle" (radians), "factor"
    ParameterKind kind;
    double initial = 0.0;  // the default; for a boolean 0 or 1, for a choice the index in `choices`
    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    std::span<const std::string_view> choices{};  // only of a choice
};

/// The nearest valid value: clamped to the limits; rounded unless the kind is number; for a choice, one of its
/// indices. NaN gives the default.
[[nodiscard]] inline double valid_value(const Parameter& parameter, double value) noexcept {
    if (std::isnan(value)) return parameter.initial;
    switch (parameter.kind) {
        case ParameterKind::number: break;
        case ParameterKind::integer: value = std::round(value); break;
        case ParameterKind::boolean: return value != 0.0 ? 1.0 : 0.0;
        case ParameterKind::choice:
            return std::clamp(std::round(value), 0.0, static_cast<double>(parameter.choices.size()) - 1.0);
        case ParameterKind::vertex_group:
        case ParameterKind::method: return parameter.initial;  // no number
    }
    return std::clamp(value, parameter.minimum, parameter.maximum);
}

/// What a method needs besides points, influences and bone transforms.
enum class Needs : unsigned {
    nothing = 0,
    rest_bones = 1,      // rest axes and heads of the bones
    vertex_data = 2,     // numbers for each vertex: MethodInfo::vertex_floats
    topology = 4,        // the mesh's triangles, from which the vertex data is computed
    precomputation = 8,  // a function that computes the vertex data and takes longer than a frame
};

[[nodiscard]] constexpr Needs operator|(Needs a, Needs b) noexcept {
    return static_cast<Needs>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

/// Whether `needs` includes all flags of `of`.
[[nodiscard]] constexpr bool has(Needs needs, Needs flags) noexcept {
    return (static_cast<unsigned>(needs) & static_cast<unsigned>(flags)) == static_cast<unsigned>(flags);
}

/// What methods are for. In the order of menus.
enum class MethodGroup {
    blender,        // methods of Blender's own Armature modifier
    volume,         // methods that keep the volume where bones twist and bend
    crude_weights,  // methods that make good shapes of unpainted weights
    mmd,            // for models of MikuMikuDance
    report,         // methods compared in Smith 2013, and candidates for it
};

/// The heading of a group in menus.
[[nodiscard]] constexpr std::string_view label_of(MethodGroup group) noexcept {
    constexpr std::string_view kLabels[] = {"Blender's", "Volume Keeping", "For Crude Weights", "For MMD",
                                            "Experimental"};
    return kLabels[static_cast<std::size_t>(group)];
}

/// The facts about a method. Each method has one, named `info`.
struct MethodInfo {
    int number;              // stored in .blend files: never changed and never reused
    std::string_view name;   // the name in programs
    std::string_view label;  // the name in the interface
    MethodGroup group;
    std::string_view description;  // one sentence: when to use it
    std::string_view source;       // the papers
    Needs needs;
    std::span<const Parameter> parameters{};  // numbers and choices, with values set for each frame
    std::size_t vertex_floats = 0;  // numbers kept for each vertex or, if rows_by_bone, for each row
    // Vertex data is rows, any number for each vertex: its number, that of a bone, the weight, and more numbers.
    bool rows_by_bone = false;
};

/// Methods are identified by their number.
[[nodiscard]] constexpr bool operator==(const MethodInfo& a, const MethodInfo& b) noexcept {
    return a.number == b.number;
}

/// The facts about a stage. Stages run after a method.
struct StageInfo {
    std::string_view name;
    std::string_view label;
    std::string_view description;
    std::string_view source;
    std::span<const Parameter> parameters{};
};

/// How the library deforms whole meshes with a method: see lanes/kernel.h.
struct Kernel;

}  // namespace sinew
