// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "sinew/mesh/influence.h"
#include "sinew/methods/method_info.h"
#include "sinew/stages/stage.h"
#include "sinew/transform/affine.h"

namespace sinew {

/// A bone as a line segment. If its length is 0, it is a point.
template <class T>
struct BoneSegment {
    Vec3<T> head;
    Vec3<T> tail;
};

/// Which bones of a vertex BulgeLimitDefinition measures the distance to. In the order of BulgeLimitDefinition::kForms.
enum class BulgeForm {
    continuous,  // all of them, weighted
    kim_han,     // only the heaviest (the first, if several are equal): tears the surface where that changes
};

/// Limit Bulge: moves a vertex of two or more bones back towards them where blending took it farther from them
/// than it is at rest, such as the tip of a bent elbow.
struct BulgeLimitDefinition {
    static constexpr std::string_view kForms[] = {"continuous", "kim_han"};
    static constexpr Parameter kParameters[] = {
        {"enabled", "Limit Bulge", "Keep vertices from bulging away from their bones", "",
         ParameterKind::boolean, 0.0, 0.0, 1.0},
        {"strength", "Strength", "How much of the bulge is taken away: 0 nothing, 1 all of it", "factor",
         ParameterKind::number, 1.0, 0.0, 1.0},
        {.id = "form",
         .label = "Form",
         .description =
             "Measure the distance to all bones of a vertex, or to the heaviest alone, which tears the "
             "surface where that changes",
         .unit = "",
         .kind = ParameterKind::choice,
         .choices = kForms},
        {"group", "Vertex Group", "How much each vertex is limited: 0 not at all, 1 fully", "factor",
         ParameterKind::vertex_group},
    };
    static constexpr StageInfo info{
        "bulge_limit", "Limit Bulge",
        "Elbows and knees that bulge where they bend stay as thick as they are at rest",
        "Kim, Han 2014; the continuous form is Sinew's own", kParameters};

    /// Factor on rest distances that absorbs rounding, so that the rest pose is returned bit for bit.
    static constexpr double kAllowance = 1.0 + 1e-6;

    /// The vector from `point` to the nearest point of the segment.
    template <class T>
    [[nodiscard]] static Vec3<T> to_segment(const BoneSegment<T>& segment, const Vec3<T>& point) noexcept {
        const Vec3<T> along = segment.tail - segment.head;
        const Vec3<T> from_head = point - segment.head;
        const T squared = glm::dot(along, along);
        const T share = squared > T(0) ? std::clamp(glm::dot(from_head, along) / squared, T(0), T(1)) : T(0);
        return share * along - from_head;
    }

    /// The largest factor by which a bone's motion lengthens vectors perpendicular to its segment. The allowed
    /// distance grows by it. A segment of length 0 has no perpendicular directions; its factor is the root mean
    /// square over all directions.
    template <class T>
    [[nodiscard]] static T stretch(const Mat3<T>& linear, const BoneSegment<T>& rest_segment) noexcept {
        const Vec3<T> along = rest_segment.tail - rest_segment.head;
        const Vec3<T> columns(glm::dot(linear[0], linear[0]), glm::dot(linear[1], linear[1]),
                              glm::dot(linear[2], linear[2]));
        if (glm::dot(along, along) == T(0)) return std::sqrt((columns.x + columns.y + columns.z) / T(3));
        // Only the components of the two images perpendicular to the posed bone count.
        const Vec3<T> axis = glm::normalize(along);
        const Vec3<T> other = std::abs(axis.x) < T(0.6) ? Vec3<T>(1, 0, 0) : Vec3<T>(0, 1, 0);
        const Vec3<T> u = glm::normalize(glm::cross(axis, other));
        const Vec3<T> posed = linear * axis;
        const T squared = glm::dot(posed, posed);
        const auto across = [&](const Vec3<T>& v) {
            const Vec3<T> image = linear * v;
            return squared > T(0) ? image - glm::dot(image, posed) / squared * posed : image;
        };
        const Vec3<T> a = across(u);
        const Vec3<T> b = across(glm::cross(axis, u));
        // The larger eigenvalue of the 2x2 Gram matrix of a and b.
        const T mean = (glm::dot(a, a) + glm::dot(b, b)) / T(2);
        const T difference = (glm::dot(a, a) - glm::dot(b, b)) / T(2);
        return std::sqrt(mean + std::hypot(difference, glm::dot(a, b)));
    }

    /// The distance of a vertex from its bones at rest.
    ///
    /// segments    one for each index in `influences`
    /// influences  at least one; weights >= 0 with sum 1
    template <class T>
    [[nodiscard]] static T rest_distance(BulgeForm form, std::span<const BoneSegment<T>> segments,
                                         std::span<const Influence<T>> influences,
                                         const Vec3<T>& rest) noexcept {
        const auto distance = [&](const Influence<T>& influence) {
            return glm::length(to_segment(segments[static_cast<std::size_t>(influence.bone)], rest));
        };
        if (form == BulgeForm::kim_han) return distance(heaviest(influences));
        T sum(0);
        for (const Influence<T>& influence : influences) sum += influence.weight * distance(influence);
        return sum;
    }

    /// A posed bone.
    template <class T>
    struct Bone {
        BoneSegment<T> segment;
        T stretch;
    };

    /// The vertex after limiting.
    ///
    /// bones          posed, one for each index in `influences`
    /// influences     weights >= 0 with sum 1; with fewer than two positive weights the vertex is not moved
    /// rest_distance  rest_distance() for the same form
    /// amount         strength times the vertex's weight in the group, 0 to 1
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(BulgeForm form, std::span<const Bone<T>> bones,
                                               std::span<const Influence<T>> influences, T rest_distance,
                                               T amount, const Vec3<T>& point) noexcept {
        const auto moving = std::count_if(influences.begin(), influences.end(),
                                          [](const auto& influence) { return influence.weight > T(0); });
        if (moving < 2) return point;
        Vec3<T> to_bones(T(0));
        T stretched(0);
        const auto add = [&](const Influence<T>& influence, T weight) {
            const Bone<T>& bone = bones[static_cast<std::size_t>(influence.bone)];
            to_bones += weight * to_segment(bone.segment, point);
            stretched += weight * bone.stretch;
        };
        if (form == BulgeForm::kim_han) {
            add(heaviest(influences), T(1));
        } else {
            for (const Influence<T>& influence : influences) add(influence, influence.weight);
        }
        const T allowed = T(kAllowance) * rest_distance * stretched;
        const T distance = glm::length(to_bones);
        if (!(distance > allowed)) return point;
        return point + amount * (T(1) - allowed / distance) * to_bones;
    }
};

/// What a BulgeLimit is constructed from besides a Binding.
struct BulgeLimitData {
    std::span<const BoneSegment<float>> segments;  // [bones] at rest, in the space of posed_from_rest
    Affine<float> bones_from_model{};              // maps rest points to that space; invertible
    std::span<const float> weights{};  // [vertices] of the vertex group, clamped to 0 to 1; empty: all 1
};

/// How to limit one frame.
struct BulgeLimitOptions {
    BulgeForm form = BulgeForm::continuous;
    float strength = 1.0f;  // clamped to 0 to 1; NaN: 1
    std::size_t threads = 0;
};

/// The stage `bulge_limit` for one mesh, applied after Deformer::deform().
class SINEW_EXPORT BulgeLimit : public BoneStage {
public:
    /// Shares the memory of `binding`. Throws also for fewer segments than bones, and for a singular transform.
    BulgeLimit(const Binding& binding, const BulgeLimitData& data);

    /// Limits the points in place.
    ///
    /// points           [vertices] deformed, model space
    /// posed_from_rest  [bones] finite
    ///
    /// Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit for bit.
    Status apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
                 const BulgeLimitOptions& options = {}) const noexcept;

private:
    struct State;
};

}  // namespace sinew
