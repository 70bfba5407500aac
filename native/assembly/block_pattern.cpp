#include "assembly/block_pattern.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace qlb {
namespace {

void check_nodes(std::span<const std::int32_t> given, std::int64_t nodes) {
  for (const std::int32_t node : given)
    if (node < 0 || node >= nodes)
      throw std::invalid_argument("node index " + std::to_string(node) + " is outside [0, " + std::to_string(nodes) +
                                  ")");
}

}  // namespace

BlockPattern::BlockPattern(std::int64_t nodes, std::span<const std::int32_t> cliques, std::int64_t width)
    : nodes_(nodes) {
  check_nodes(cliques, nodes);

  // Two passes over all pairs: count the entries of each column, then fill; duplicates go in the sort below.
  const auto for_each_pair = [&](auto&& visit) {
    for (std::int32_t i = 0; i < nodes; ++i) visit(i, i);
    for (std::size_t first = 0; first < cliques.size(); first += width)
      for (std::int64_t a = 0; a < width; ++a)
        for (std::int64_t b = 0; b < a; ++b) {
          const auto [low, high] = std::minmax(cliques[first + a], cliques[first + b]);
          if (low != high) visit(high, low);
        }
  };
  std::vector<std::int64_t> begin(nodes + 1, 0);
  for_each_pair([&](std::int32_t, std::int32_t column) { ++begin[column + 1]; });
  for (std::int64_t j = 0; j < nodes; ++j) begin[j + 1] += begin[j];
  std::vector<std::int32_t> all(begin.back());
  std::vector<std::int64_t> next(begin.begin(), begin.end() - 1);
  for_each_pair([&](std::int32_t row, std::int32_t column) { all[next[column]++] = row; });

  column_begin_.assign(nodes + 1, 0);
  row_.reserve(all.size() / 3);
  for (std::int64_t j = 0; j < nodes; ++j) {
    const auto first = all.begin() + begin[j], last = all.begin() + begin[j + 1];
    std::sort(first, last);
    row_.insert(row_.end(), first, std::unique(first, last));
    column_begin_[j + 1] = static_cast<std::int64_t>(row_.size());
  }
  row_.shrink_to_fit();
}

std::int64_t BlockPattern::look_up(std::int32_t i, std::int32_t j) const {
  const auto [column, row] = std::minmax(i, j);
  const auto first = row_.begin() + column_begin_[column], last = row_.begin() + column_begin_[column + 1];
  const auto found = std::lower_bound(first, last, row);
  return found == last || *found != row ? -1 : found - row_.begin();
}

std::int64_t BlockPattern::find(std::int32_t i, std::int32_t j) const {
  const std::int64_t found = look_up(i, j);
  if (found < 0)
    throw std::out_of_range("block (" + std::to_string(i) + ", " + std::to_string(j) + ") is not in the pattern");
  return found;
}

void BlockPattern::holds(std::span<const std::int32_t> stencils, std::uint8_t* held) const {
  check_nodes(stencils, nodes_);
  for (std::size_t first = 0; first < stencils.size(); first += 4) {
    bool all = true;
    for (int a = 1; a < 4 && all; ++a)
      for (int b = 0; b < a && all; ++b) all = look_up(stencils[first + a], stencils[first + b]) >= 0;
    held[first / 4] = all;
  }
}

}  // namespace qlb
