// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/binding.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sinew/methods/check_bind_data.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

/// Checks rows by bone: the number of the vertex, that of the bone, its weight, and more numbers. Adds to `bones` those
/// of rows that are not all 0.
void check_rows_by_bone(const std::string& name, std::span<const float> values, std::size_t floats,
                        std::size_t vertex_count, std::vector<std::int32_t>& bones) {
    if (values.size() % floats != 0) {
        fail("vertex_data", "rows of " + std::to_string(floats) + " numbers of " + name,
             std::to_string(values.size()) + " numbers");
    }
    const auto is_number = [](float value, std::size_t count) {
        return value >= 0.0f && value < static_cast<float>(count) && value == std::floor(value);
    };
    for (std::size_t i = 0; i < values.size(); i += floats) {
        const auto row = values.subspan(i, floats);
        const auto check_number = [&](std::size_t column, bool is_right, const char* wanted) {
            if (is_right) return;
            fail("vertex_data", std::string(wanted) + " in column " + std::to_string(column) + " of " + name,
                 std::to_string(row[column]) + " in row " + std::to_string(i / floats));
        };
        for (std::size_t column = 0; column < floats; ++column) {
            check_number(column, std::isfinite(row[column]), "finite values");
        }
        check_number(0, is_number(row[0], vertex_count), "numbers of vertices");
        check_number(1, is_number(row[1], kMaxBones), "numbers of bones");
        check_number(2, row[2] >= 0.0f, "weights of 0 and more");
        if (i > 0) {
            const auto before = values.subspan(i - floats, floats);
            if (!(before[0] < row[0] || (before[0] == row[0] && before[1] < row[1]))) {
                fail("vertex_data", "rows of " + name + " in ascending order of vertices and bones",
                     "another order in row " + std::to_string(i / floats));
            }
        }
        if (std::ranges::any_of(row.subspan(2), [](float value) { return value != 0.0f; })) {
            bones.push_back(static_cast<std::int32_t>(row[1]));
        }
    }
}

/// Checks the vertex data of a method. Returns the bones that it names besides those of the influences.
std::vector<std::int32_t> checked_bones(const VertexData& data, std::size_t vertex_count) {
    const MethodInfo& method = kMethods[checked_method("vertex_data", data.method)];
    const std::string name(method.name);
    const std::size_t floats = method.vertex_floats;
    if (floats == 0) fail("vertex_data", "that of methods that need it", "that of " + name);
    std::vector<std::int32_t> bones;
    if (data.is_linear) {
        if (!data.values.empty()) {
            fail("vertex_data", "no values where " + name + " is to blend linearly",
                 std::to_string(data.values.size()));
        }
        return bones;
    }
    if (method.rows_by_bone) {
        check_rows_by_bone(name, data.values, floats, vertex_count, bones);
        return bones;
    }
    if (data.values.size() != vertex_count * floats) {
        fail("vertex_data", std::to_string(vertex_count * floats) + " numbers of " + name,
             std::to_string(data.values.size()));
    }
    for (std::size_t i = 0; i < data.values.size(); ++i) {
        if (!std::isfinite(data.values[i])) {
            fail("vertex_data", "finite values",
                 "NaN or infinity of " + name + " at vertex " + std::to_string(i / floats));
        }
    }
    return bones;
}

}  // namespace

const Kernel& kernel_at(std::size_t method) noexcept {
    static const auto kernels =
        std::apply([](const auto&... methods) { return std::array{&methods.kernel()...}; }, Methods{});
    return *kernels[method];
}

std::size_t checked_method(const std::string& argument, const MethodInfo& method) {
    const std::size_t index = index_of(method);
    if (index < kMethodCount) return index;
    std::string names;
    for (const MethodInfo& known : kMethods) names += (names.empty() ? "" : ", ") + std::string(known.name);
    fail(argument, "one of " + names, "a method of number " + std::to_string(method.number));
}

std::size_t checked_method(const std::string& argument, const MethodInfo& method,
                           const PackedBinding& binding) {
    const std::size_t index = checked_method(argument, method);
    const MethodInfo& known = kMethods[index];
    if (known.vertex_floats > 0 && binding.vertex_data[index] == nullptr && !binding.is_linear[index]) {
        const std::string name(known.name);
        fail("vertex_data", "that of " + name + ", or " + name + " by name without data, for linear blending",
             "none");
    }
    return index;
}

PackedBinding::PackedBinding(const BindData& data) {
    check(data);
    vertex_count = data.rest_points.size();
    // Vertex data may name bones that no influence names, since its weights may depend on the vertices' positions.
    std::vector<std::int32_t> more_bones;
    for (const VertexData& of_method : data.vertex_data) {
        const std::vector<std::int32_t> bones = checked_bones(of_method, vertex_count);
        more_bones.insert(more_bones.end(), bones.begin(), bones.end());
    }
    for (const auto& bones : {data.influence_bones, std::span<const std::int32_t>(more_bones)}) {
        for (const std::int32_t bone : bones) {
            bone_count = std::max(bone_count, static_cast<std::size_t>(bone) + 1);
        }
    }
    check_rest_bones(data.rest_bones, bone_count);

    const NormalisedInfluences normalised = normalised_influences(data);
    influence_count = normalised.influences.size();
    mesh = pack(data.rest_points, normalised.offsets, normalised.influences, more_bones);
    for (const VertexData& of_method : data.vertex_data) {
        const std::size_t method = index_of(of_method.method);
        is_linear[method] = of_method.is_linear;
        if (!of_method.is_linear)
            vertex_data[method] = kernel_at(method).pack_vertex_data(mesh, of_method.values);
    }

    if (data.rest_bones.empty()) return;
    for (const std::int32_t bone : mesh.used_bones) {
        const Affine<float>& rest_bone = data.rest_bones[static_cast<std::size_t>(bone)];
        if (!has_unit_axes(cast<double>(rest_bone))) {
            stretched_bones.push_back(static_cast<std::int32_t>(rest_bones.size()));
        }
        rest_bones.push_back(rest_bone);
    }
}

BoundMesh PackedBinding::unpack(std::span<const Lanes<float>> rest_points) const {
    const auto last_bone = static_cast<std::int32_t>(bone_count) - 1;
    const UnpackedMesh unpacked = sinew::unpack(mesh, rest_points, vertex_count);
    BoundMesh bound{unpacked.rest_points, {}, {}, {}, {}, {}};
    bound.influence_offsets.assign(unpacked.offsets.begin(), unpacked.offsets.end());
    for (const auto& [bone, weight] : unpacked.influences) {
        bound.influence_bones.push_back(bone);
        bound.influence_weights.push_back(weight);
    }
    if (bone_count > 0 && (mesh.used_bones.empty() || mesh.used_bones.back() < last_bone)) {
        // The highest bone was named by an influence without weight, which was dropped: give it back to the last
        // vertex.
        bound.influence_bones.push_back(last_bone);
        bound.influence_weights.push_back(0.0f);
        ++bound.influence_offsets.back();
    }
    for (std::size_t i = 0; i < kMethodCount; ++i) {
        if (is_linear[i]) bound.vertex_data.push_back({kMethods[i], {}, true});
        if (vertex_data[i] == nullptr) continue;
        bound.vertex_data.push_back({kMethods[i], vertex_data[i]->unpack(mesh, vertex_count)});
    }
    if (rest_bones.empty()) return bound;
    bound.rest_bones.resize(bone_count);
    for (std::size_t i = 0; i < mesh.used_bones.size(); ++i) {
        bound.rest_bones[static_cast<std::size_t>(mesh.used_bones[i])] = rest_bones[i];
    }
    return bound;
}

Binding::Binding(const BindData& data) : packed_(std::make_shared<const PackedBinding>(data)) {}

std::size_t Binding::vertex_count() const noexcept { return packed_->vertex_count; }
std::size_t Binding::influence_count() const noexcept { return packed_->influence_count; }
std::size_t Binding::bone_count() const noexcept { return packed_->bone_count; }
BoundMesh Binding::unpack() const { return packed_->unpack(packed_->mesh.rest_points); }

}  // namespace sinew
