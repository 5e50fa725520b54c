// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/binding.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sinew/methods/packed_binding.h"
#include "sinew/transform/split_scale.h"

namespace sinew {
namespace {

// How far the sum of normalised weights may be from 1, since each was rounded.
constexpr double kNormalised = 1e-5;

void check_limit(const std::string& argument, const std::string& of, std::size_t limit, std::size_t got) {
    if (got > limit) fail(argument, "at most " + std::to_string(limit) + " " + of, std::to_string(got));
}

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

void check(const BindData& data) {
    const std::size_t vertex_count = data.rest_points.size();
    const std::size_t influence_count = data.influence_bones.size();
    check_limit("rest_points", "vertices", kMaxVertices, vertex_count);
    check_limit("influence_bones", "influences", kMaxInfluences, influence_count);
    check_points(data.rest_points, vertex_count);
    if (data.influence_weights.size() != influence_count) {
        fail("influence_weights",
             "one for each of the " + std::to_string(influence_count) + " influence_bones",
             std::to_string(data.influence_weights.size()));
    }
    if (data.influence_offsets.size() != vertex_count + 1) {
        fail("influence_offsets", std::to_string(vertex_count + 1) + " values (vertices + 1)",
             std::to_string(data.influence_offsets.size()));
    }
    if (data.influence_offsets.front() != 0) {
        fail("influence_offsets", "0 at the start", std::to_string(data.influence_offsets.front()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        if (data.influence_offsets[vertex + 1] < data.influence_offsets[vertex]) {
            fail("influence_offsets", "values that never fall",
                 std::to_string(data.influence_offsets[vertex + 1]) + " after " +
                     std::to_string(data.influence_offsets[vertex]) + " at vertex " + std::to_string(vertex));
        }
    }
    if (static_cast<std::size_t>(data.influence_offsets.back()) != influence_count) {
        fail("influence_offsets", std::to_string(influence_count) + " at the end (the number of influences)",
             std::to_string(data.influence_offsets.back()));
    }
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const auto count =
            static_cast<std::size_t>(data.influence_offsets[vertex + 1] - data.influence_offsets[vertex]);
        if (count > kMaxVertexInfluences) {
            fail("influence_offsets",
                 "at most " + std::to_string(kMaxVertexInfluences) + " influences a vertex",
                 std::to_string(count) + " at vertex " + std::to_string(vertex));
        }
    }
    for (std::size_t i = 0; i < influence_count; ++i) {
        const std::int32_t bone = data.influence_bones[i];
        if (bone < 0) {
            fail("influence_bones", "indices of bones, 0 or more",
                 std::to_string(bone) + " at influence " + std::to_string(i));
        }
        if (static_cast<std::size_t>(bone) >= kMaxBones) {
            fail("influence_bones", "indices of bones below " + std::to_string(kMaxBones),
                 std::to_string(bone) + " at influence " + std::to_string(i));
        }
        const float weight = data.influence_weights[i];
        if (!std::isfinite(weight) || weight < 0.0f) {
            fail("influence_weights", "finite values, 0 or more",
                 std::to_string(weight) + " at influence " + std::to_string(i));
        }
    }
}

NormalisedInfluences normalised_influences(const BindData& data) {
    NormalisedInfluences result;
    result.offsets.reserve(data.rest_points.size() + 1);
    result.influences.reserve(data.influence_bones.size());
    for (std::size_t vertex = 0; vertex < data.rest_points.size(); ++vertex) {
        const auto begin = static_cast<std::size_t>(data.influence_offsets[vertex]);
        const auto end = static_cast<std::size_t>(data.influence_offsets[vertex + 1]);
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(data.influence_weights[i]);
        if (data.is_normalised && sum != 0.0 && !(std::abs(sum - 1.0) < kNormalised)) {
            fail("influence_weights", "normalised ones, of sum 1",
                 "sum " + std::to_string(sum) + " at vertex " + std::to_string(vertex));
        }
        for (std::size_t i = begin; i < end; ++i) {
            const double weight = static_cast<double>(data.influence_weights[i]);
            const auto share = static_cast<float>(data.is_normalised ? weight : weight / sum);
            if (share > 0.0f) result.influences.push_back({data.influence_bones[i], share});
        }
        result.offsets.push_back(static_cast<std::uint32_t>(result.influences.size()));
    }
    return result;
}

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
