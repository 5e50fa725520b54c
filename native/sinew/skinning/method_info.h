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

/// What the value of a parameter is.
enum class ParameterKind {
    number,        // float
    integer,       // int
    boolean,       // bool
    choice,        // one of Parameter::choices
    vertex_group,  // float32 [vertices]: a weight for each vertex
    method,        // the name of a method
};

/// The name of a kind for programs: "float", "int", "bool", "enum", "vertex_group", "method".
[[nodiscard]] constexpr std::string_view name_of(ParameterKind kind) noexcept {
    constexpr std::string_view kNames[] = {"float", "int", "bool", "enum", "vertex_group", "method"};
    return kNames[static_cast<std::size_t>(kind)];
}

/// Whether `kind` has Parameter::initial, minimum and maximum.
[[nodiscard]] constexpr bool is_numeric(ParameterKind kind) noexcept {
    return kind == ParameterKind::number || kind == ParameterKind::integer || kind == ParameterKind::boolean;
}

/// A setting of a method or of a stage.
struct Parameter {
    std::string_view id;           // what programs say
    std::string_view label;        // what people read
    std::string_view description;  // one sentence
    std::string_view unit;         // "", "length", "angle" (radians), "factor"
    ParameterKind kind;
    double initial = 0.0;  // the default; 0 or 1 of a boolean, the index in `choices` of a choice
    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    std::span<const std::string_view> choices{};  // of a choice
};

/// The value that `value` stands for: within the limits, whole unless the kind is number, and of a choice one of its
/// indices. NaN stands for the default.
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

/// What a method takes besides points, influences and bone transforms.
enum class Needs : unsigned {
    nothing = 0,
    rest_bones = 1,      // rest axes and heads of bones
    vertex_data = 2,     // numbers of each vertex: MethodInfo::vertex_floats
    topology = 4,        // the mesh's triangles, which the vertex data is made from
    precomputation = 8,  // a function that makes the vertex data, in more than a frame's time
};

[[nodiscard]] constexpr Needs operator|(Needs a, Needs b) noexcept {
    return static_cast<Needs>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

/// Whether `needs` has all of `of`.
[[nodiscard]] constexpr bool has(Needs needs, Needs of) noexcept {
    return (static_cast<unsigned>(needs) & static_cast<unsigned>(of)) == static_cast<unsigned>(of);
}

/// What methods are for, in the order in which menus show it.
enum class MethodGroup {
    blender,        // those that Blender's own Armature modifier has
    volume,         // joints that twist and bend keep their volume
    crude_weights,  // good shapes from weights that nobody painted
    mmd,            // models of MikuMikuDance
    report,         // what Smith 2013 compares, and its candidates
};

/// The heading of a group, for people.
[[nodiscard]] constexpr std::string_view label_of(MethodGroup group) noexcept {
    constexpr std::string_view kLabels[] = {"Blender's", "Volume Keeping", "For Crude Weights", "For MMD",
                                            "From the Report"};
    return kLabels[static_cast<std::size_t>(group)];
}

/// Facts of a method. Each method has its own, as `info`.
struct MethodInfo {
    int number;              // stored in .blend files: never changed, never used again
    std::string_view name;   // what programs say
    std::string_view label;  // what people read
    MethodGroup group;
    std::string_view description;  // one sentence: when to use it
    std::string_view source;       // the papers
    Needs needs;
    std::span<const Parameter> parameters{};  // numbers and choices, which each frame has its own of
    std::size_t vertex_floats = 0;  // numbers that it keeps of each vertex; or, of each row, if keeps_moments
    bool keeps_moments = false;     // it keeps rows, any number a vertex: see skinning/moments.h
};

/// The number is the method's identity.
[[nodiscard]] constexpr bool operator==(const MethodInfo& a, const MethodInfo& b) noexcept {
    return a.number == b.number;
}

/// Facts of a stage: what may follow a method.
struct StageInfo {
    std::string_view name;
    std::string_view label;
    std::string_view description;
    std::string_view source;
    std::span<const Parameter> parameters{};
};

/// How the library deforms whole meshes by a method: see deform/kernels.h.
struct Kernel;

}  // namespace sinew
