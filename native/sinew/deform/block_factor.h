// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace sinew {

/// Consecutive columns of a factor that are stored as if all of them had the same rows below (a supernode). One
/// row index serves all columns of a block, and the right side is read once for many columns.
struct FactorBlock {
    std::uint32_t first;      // the first column
    std::uint32_t width;      // number of columns
    std::uint32_t first_row;  // index into BlockFactor::rows
    std::uint32_t row_count;  // number of rows below the block, common to all its columns
    std::size_t first_value;  // index into BlockFactor::values
};

/// The factor L of a matrix L D L^T. L has unit diagonal.
struct BlockFactor {
    std::vector<FactorBlock> blocks;
    std::vector<std::int32_t> rows;
    // For each block, row by row: first the triangle (row k has k numbers), then `width` numbers for each row
    // below.
    std::vector<double> values;
    std::vector<double> diagonal;  // the diagonal of D

    [[nodiscard]] static constexpr std::size_t triangle(std::size_t width) { return width * (width - 1) / 2; }
};

/// starts, rows, values  L below its diagonal by columns: [columns + 1], rising rows of each column
[[nodiscard]] BlockFactor make_block_factor(std::span<const std::int32_t> starts,
                                            std::span<const std::int32_t> rows,
                                            std::span<const double> values, std::vector<double> diagonal);

/// Right sides are solved in groups of so many. The first of a group is not negative, and says where the group is 0.
inline constexpr std::size_t kGroupColumns = 10;

/// Groups that are solved together: so many fill five of the widest vectors.
inline constexpr std::size_t kGroups = 4;

/// Right sides of one row.
inline constexpr std::size_t kSolvedColumns = kGroups * kGroupColumns;

/// From right sides to solutions, which may differ by rounding on other instruction sets.
///
/// nothing   where the first of a group is less, the group is 0
/// x         [columns][kSolvedColumns]
/// is_there  [columns] 0 where all of these are 0, else 1
using SolveBlocks = void(const BlockFactor& factor, double nothing, double* x, std::uint8_t* is_there);

/// For the instruction set in use.
[[nodiscard]] SolveBlocks* solve_blocks() noexcept;

}  // namespace sinew
