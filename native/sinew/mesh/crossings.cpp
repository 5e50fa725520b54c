// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/mesh/crossings.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "sinew/base/thread_pool.h"

namespace sinew {
namespace {

using Point = Vec3<double>;
using Corners = std::array<std::int32_t, 3>;
using Triangle = std::array<Point, 3>;

struct Box {
    Point low, high;
};

bool meet(const Box& a, const Box& b) noexcept {
    return glm::all(glm::lessThanEqual(a.low, b.high)) && glm::all(glm::lessThanEqual(b.low, a.high));
}

Box around(const Box& a, const Box& b) noexcept { return {glm::min(a.low, b.low), glm::max(a.high, b.high)}; }

/// Boxes around triangles [begin, end) of an order in which neighbours follow each other. `skip` is the node behind all
/// children, as nodes are stored in the order in which they are visited.
struct Node {
    Box box;
    std::size_t begin, end, skip;
};

constexpr std::size_t kMostInLeaf = 4;
constexpr std::size_t kWorthAThread = 2048;
constexpr std::size_t kChunk = 256;

/// Interleaves with two zeros the ten bits of `value`, 0 to 1.
std::uint64_t spread_bits(double value) noexcept {
    auto bits = static_cast<std::uint64_t>(std::clamp(value, 0.0, 1.0) * 1023.0);
    bits = (bits | bits << 16) & 0x030000FF;
    bits = (bits | bits << 8) & 0x0300F00F;
    bits = (bits | bits << 4) & 0x030C30C3;
    return (bits | bits << 2) & 0x09249249;
}

class Tree {
public:
    /// boxes  of triangles, by their place in the order
    explicit Tree(std::span<const Box> boxes) : boxes_(boxes) {
        nodes_.reserve(boxes.size());
        if (!boxes.empty()) add(0, boxes.size());
    }

    /// Calls found(place) for each triangle behind `place` in the order whose box meets that one's.
    template <class Found>
    void visit_behind(std::size_t place, const Found& found) const {
        const Box& box = boxes_[place];
        for (std::size_t i = 0; i < nodes_.size();) {
            const Node& node = nodes_[i];
            if (node.end <= place + 1 || !meet(node.box, box)) {
                i = node.skip;
                continue;
            }
            if (node.skip == i + 1) {
                for (std::size_t other = std::max(node.begin, place + 1); other < node.end; ++other) {
                    if (meet(boxes_[other], box)) found(other);
                }
            }
            ++i;
        }
    }

private:
    Box add(std::size_t begin, std::size_t end) {
        const std::size_t own = nodes_.size();
        nodes_.push_back({boxes_[begin], begin, end, 0});
        Box box = boxes_[begin];
        if (end - begin > kMostInLeaf) {
            const std::size_t middle = begin + (end - begin) / 2;
            box = add(begin, middle);
            box = around(box, add(middle, end));
        } else {
            for (std::size_t i = begin + 1; i < end; ++i) box = around(box, boxes_[i]);
        }
        nodes_[own].box = box;
        nodes_[own].skip = nodes_.size();
        return box;
    }

    std::span<const Box> boxes_;
    std::vector<Node> nodes_;
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
    std::size_t threads) {
    const auto corners_of = [&](const Corners& corners) {
        Triangle triangle;
        for (std::size_t k = 0; k < 3; ++k) triangle[k] = points[static_cast<std::size_t>(corners[k])];
        return triangle;
    };
    const auto box_of = [&](const Corners& corners) {
        const auto [a, b, c] = corners_of(corners);
        return Box{glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c)};
    };
    Box whole{Point(std::numeric_limits<double>::max()), Point(std::numeric_limits<double>::lowest())};
    for (const Point& point : points) whole = around(whole, {point, point});
    const Point scale = 1.0 / glm::max(whole.high - whole.low, Point(std::numeric_limits<double>::min()));
    // Along a curve that fills space (Morton, 1966), above the number of the triangle.
    std::vector<std::uint64_t> order;
    order.reserve(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto [a, b, c] = corners_of(triangles[i]);
        const Point place = ((a + b + c) / 3.0 - whole.low) * scale;
        if (!(glm::abs(place.x + place.y + place.z) < 4.0)) continue;  // not finite
        const std::uint64_t code =
            spread_bits(place.x) << 2 | spread_bits(place.y) << 1 | spread_bits(place.z);
        order.push_back(code << 32 | i);
    }
    std::ranges::sort(order);
    const auto triangle_at = [&](std::size_t place) { return static_cast<std::uint32_t>(order[place]); };
    std::vector<Box> boxes;
    boxes.reserve(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) boxes.push_back(box_of(triangles[triangle_at(i)]));
    const Tree tree(boxes);
    using Pairs = std::vector<std::array<std::int32_t, 2>>;
    std::vector<Pairs> found((order.size() + kChunk - 1) / kChunk);
    const auto search = [&](std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
            const std::uint32_t own = triangle_at(place);
            const Corners& corners = triangles[own];
            const Triangle triangle = corners_of(corners);
            tree.visit_behind(place, [&](std::size_t behind) {
                const std::uint32_t other = triangle_at(behind);
                const Corners& its = triangles[other];
                if (share_a_vertex(corners, its)) return;
                const Triangle another = corners_of(its);
                if (an_edge_meets(triangle, another) || an_edge_meets(another, triangle)) {
                    const auto [first, second] = std::minmax(own, other);
                    found[begin / kChunk].push_back(
                        {static_cast<std::int32_t>(first), static_cast<std::int32_t>(second)});
                }
            });
        }
    };
    parallel_for(order.size(), useful_threads(threads, order.size(), kWorthAThread), search, kChunk);
    Pairs pairs;
    for (const Pairs& of : found) pairs.insert(pairs.end(), of.begin(), of.end());
    std::ranges::sort(pairs);
    return pairs;
}

}  // namespace sinew
