// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/crossings.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "sinew/base/thread_pool.h"

namespace sinew {
namespace {

using Point = Vec3<double>;
using Corners = std::array<std::int32_t, 3>;
using Triangle = std::array<Point, 3>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Box {
    Vec3<float> low, high;
};

/// Whether two ranges have nothing in common, as a number: without branches, as it can not be predicted which of the
/// comparisons fails.
int are_apart(float low, float high, float other_low, float other_high) noexcept {
    return static_cast<int>(low > other_high) | static_cast<int>(other_low > high);
}

bool meet(const Box& a, const Box& b) noexcept {
    const auto apart = [&](int axis) {
        return are_apart(a.low[axis], a.high[axis], b.low[axis], b.high[axis]);
    };
    return (apart(0) | apart(1) | apart(2)) == 0;
}

Box around(const Box& a, const Box& b) noexcept { return {glm::min(a.low, b.low), glm::max(a.high, b.high)}; }

/// A box of floats that contains the points.
Box box_around(const Triangle& points) noexcept {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        const auto [low, high] = std::minmax({points[0][axis], points[1][axis], points[2][axis]});
        box.low[axis] = static_cast<float>(low);
        box.high[axis] = static_cast<float>(high);
        if (box.low[axis] > low) box.low[axis] = std::nextafter(box.low[axis], -kInfinity);
        if (box.high[axis] < high) box.high[axis] = std::nextafter(box.high[axis], kInfinity);
    }
    return box;
}

constexpr std::int32_t kNoGroup = -1;

/// Boxes around triangles [begin, end) of an order in which neighbours follow each other. `skip` is the node behind all
/// children, as nodes are stored in the order in which they are visited. `group` is that of all, if they have one.
struct Node {
    Box box;
    std::size_t begin, end, skip;
    std::int32_t group;
};

/// A triangle's place in the order: by group, then along a curve that fills space.
struct Place {
    std::int32_t group;
    std::uint32_t code, triangle;

    auto operator<=>(const Place&) const = default;
};

constexpr std::size_t kMostInLeaf = 16;
constexpr std::size_t kWorthAThread = 128;
constexpr std::size_t kChunk = 16;

/// Interleaves with two zeros the ten bits of `value`, 0 to 1.
std::uint32_t spread_bits(double value) noexcept {
    auto bits = static_cast<std::uint32_t>(std::clamp(value, 0.0, 1.0) * 1023.0);
    bits = (bits | bits << 16) & 0x030000FF;
    bits = (bits | bits << 8) & 0x0300F00F;
    bits = (bits | bits << 4) & 0x030C30C3;
    return (bits | bits << 2) & 0x09249249;
}

class Tree {
public:
    /// boxes  of triangles, by their place in the order
    Tree(std::span<const Box> boxes, std::span<const Place> order) : boxes_(boxes), order_(order) {
        nodes_.reserve(boxes.size());
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const Box& box : boxes) {
                lows_[axis].push_back(box.low[static_cast<int>(axis)]);
                highs_[axis].push_back(box.high[static_cast<int>(axis)]);
            }
            // The last leaf is read as if it were full.
            lows_[axis].resize(boxes.size() + kMostInLeaf);
            highs_[axis].resize(boxes.size() + kMostInLeaf);
        }
        if (!boxes.empty()) add(0, boxes.size());
    }

    std::size_t leaves() const noexcept { return leaves_.size(); }

    /// Calls found(place, other) for each triangle of a leaf and each behind it in the order, of another group, whose
    /// boxes meet.
    template <class Found>
    void visit(std::size_t leaf, const Found& found) const {
        const Node& own = nodes_[leaves_[leaf]];
        // What is behind the leaf in the order is stored behind it.
        for (std::size_t i = leaves_[leaf]; i < nodes_.size();) {
            const Node& node = nodes_[i];
            if (is_one_group(node.group, own.group) || !meet(node.box, own.box)) {
                i = node.skip;
                continue;
            }
            if (node.skip == ++i) visit_pairs(own, node, found);
        }
    }

private:
    static bool is_one_group(std::int32_t a, std::int32_t b) noexcept { return a == b && a != kNoGroup; }

    template <class Found>
    void visit_pairs(const Node& own, const Node& other, const Found& found) const {
        const std::size_t count = other.end - other.begin;
        for (std::size_t place = own.begin; place < own.end; ++place) {
            const Box& box = boxes_[place];
            if (!meet(box, other.box)) continue;
            // Compilers make vectors of this loop, which has one length.
            std::array<std::int32_t, kMostInLeaf> apart;
            for (std::size_t k = 0; k < kMostInLeaf; ++k) {
                apart[k] = 0;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const float low = box.low[static_cast<int>(axis)],
                                high = box.high[static_cast<int>(axis)];
                    apart[k] |=
                        are_apart(low, high, lows_[axis][other.begin + k], highs_[axis][other.begin + k]);
                }
            }
            for (std::size_t k = place < other.begin ? 0 : place + 1 - other.begin; k < count; ++k) {
                if (apart[k] || is_one_group(order_[place].group, order_[other.begin + k].group)) continue;
                found(place, other.begin + k);
            }
        }
    }

    Box add(std::size_t begin, std::size_t end) {
        const std::size_t own = nodes_.size();
        const std::int32_t first = order_[begin].group;
        nodes_.push_back({boxes_[begin], begin, end, 0, order_[end - 1].group == first ? first : kNoGroup});
        Box box = boxes_[begin];
        if (end - begin > kMostInLeaf) {
            const std::size_t middle = begin + (end - begin) / 2;
            box = add(begin, middle);
            box = around(box, add(middle, end));
        } else {
            for (std::size_t i = begin + 1; i < end; ++i) box = around(box, boxes_[i]);
            leaves_.push_back(own);
        }
        nodes_[own].box = box;
        nodes_[own].skip = nodes_.size();
        return box;
    }

    std::span<const Box> boxes_;
    std::span<const Place> order_;
    std::vector<Node> nodes_;
    std::vector<std::size_t> leaves_;
    // The boxes again, axis by axis.
    std::array<std::vector<float>, 3> lows_, highs_;
};

/// Whether an edge of `a` meets `b`.
bool an_edge_meets(const Triangle& a, const Triangle& b) noexcept {
    const Point normal = glm::cross(b[1] - b[0], b[2] - b[0]);
    std::array<double, 3> away{};
    for (std::size_t i = 0; i < 3; ++i) away[i] = glm::dot(normal, a[i] - b[0]);
    const Point size = glm::abs(normal);
    // The plane of two axes in which the triangle has the most area.
    const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (drop + 1) % 3, v = (drop + 2) % 3;
    for (std::size_t i = 0; i < 3; ++i) {
        const double from = away[i], to = away[(i + 1) % 3];
        // Also where both are in the plane, or NaN.
        if (!((from < 0.0) != (to < 0.0)) || from == to) continue;
        const Point place = a[i] + from / (from - to) * (a[(i + 1) % 3] - a[i]);
        bool left = true, right = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const Point &p = b[k], &q = b[(k + 1) % 3];
            const double side = (q[u] - p[u]) * (place[v] - p[v]) - (q[v] - p[v]) * (place[u] - p[u]);
            left = left && side >= 0.0;
            right = right && side <= 0.0;
        }
        if (left || right) return true;
    }
    return false;
}

bool share_a_vertex(const Corners& a, const Corners& b) noexcept {
    return std::ranges::any_of(a,
                               [&](std::int32_t vertex) { return std::ranges::find(b, vertex) != b.end(); });
}

}  // namespace

std::vector<std::array<std::int32_t, 2>> crossing_triangles(
    std::span<const Vec3<double>> points, std::span<const std::array<std::int32_t, 3>> triangles,
    std::span<const std::int32_t> groups, std::size_t threads) {
    const auto corners_of = [&](const Corners& corners) {
        Triangle triangle;
        for (std::size_t k = 0; k < 3; ++k) triangle[k] = points[static_cast<std::size_t>(corners[k])];
        return triangle;
    };
    Point low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
    for (const Point& point : points) low = glm::min(low, point), high = glm::max(high, point);
    const Point scale = 1.0 / glm::max(high - low, Point(std::numeric_limits<double>::min()));
    std::vector<Place> order;
    order.reserve(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto [a, b, c] = corners_of(triangles[i]);
        const Point place = ((a + b + c) / 3.0 - low) * scale;
        if (!(glm::abs(place.x + place.y + place.z) < 4.0)) continue;  // not finite
        // Along the curve of Morton (1966).
        const std::uint32_t code =
            spread_bits(place.x) << 2 | spread_bits(place.y) << 1 | spread_bits(place.z);
        const std::int32_t group = groups.empty() ? kNoGroup : std::max(groups[i], kNoGroup);
        order.push_back({group, code, static_cast<std::uint32_t>(i)});
    }
    std::ranges::sort(order);
    std::vector<Box> boxes;
    boxes.reserve(order.size());
    for (const Place& place : order) boxes.push_back(box_around(corners_of(triangles[place.triangle])));
    const Tree tree(boxes, order);
    using Pairs = std::vector<std::array<std::int32_t, 2>>;
    std::vector<Pairs> found((tree.leaves() + kChunk - 1) / kChunk);
    const auto search = [&](std::size_t begin, std::size_t end) {
        const auto add_crossing = [&](std::size_t place, std::size_t behind) {
            const std::uint32_t own = order[place].triangle, other = order[behind].triangle;
            if (share_a_vertex(triangles[own], triangles[other])) return;
            const Triangle a = corners_of(triangles[own]), b = corners_of(triangles[other]);
            if (!an_edge_meets(a, b) && !an_edge_meets(b, a)) return;
            const auto [first, second] = std::minmax(own, other);
            found[begin / kChunk].push_back(
                {static_cast<std::int32_t>(first), static_cast<std::int32_t>(second)});
        };
        for (std::size_t leaf = begin; leaf < end; ++leaf) tree.visit(leaf, add_crossing);
    };
    parallel_for(tree.leaves(), useful_threads(threads, tree.leaves(), kWorthAThread), search, kChunk);
    Pairs pairs;
    for (const Pairs& of : found) pairs.insert(pairs.end(), of.begin(), of.end());
    std::ranges::sort(pairs);
    return pairs;
}

}  // namespace sinew
