#include <algorithm>
#include <array>
#include <numeric>

#include "linalg/supernodal_factor.hpp"

namespace qlb {
namespace {

class MapBuilder {
 public:
  MapBuilder(const Supernodes& supernodes, std::int64_t nodes)
      : supernodes_(supernodes), owner_(supernodes.dof.size()), rank_(3 * nodes, -1) {
    for (std::int32_t s = 0; s < supernodes.count(); ++s)
      std::fill(owner_.begin() + supernodes.first[s], owner_.begin() + supernodes.first[s + 1], s);
    for (std::size_t k = 0; k < supernodes.dof.size(); ++k) rank_[supernodes.dof[k]] = static_cast<std::int32_t>(k);
  }
  bool free(std::int64_t node) const {
    return rank_[3 * node] >= 0 && rank_[3 * node + 1] >= 0 && rank_[3 * node + 2] >= 0;
  }
  std::int32_t rank(std::int64_t dof) const { return rank_[dof]; }
  std::int32_t owner(std::int32_t column) const { return owner_[column]; }
  // Place of a row in the front of supernode s.
  std::int32_t row(std::int32_t s, std::int32_t column) const {
    if (column < supernodes_.first[s + 1]) return column - supernodes_.first[s];
    const std::int32_t* rows = supernodes_.rows(s);
    const auto below = std::lower_bound(rows, rows + supernodes_.rows_below(s), column) - rows;
    return static_cast<std::int32_t>(supernodes_.columns(s) + below);
  }

 private:
  const Supernodes& supernodes_;
  std::vector<std::int32_t> owner_, rank_;
};

// Items with the supernode of each, grouped by supernode.
template <class Item>
std::vector<std::int64_t> group(std::vector<Item>& items, const std::vector<std::int32_t>& owner, std::int32_t count) {
  std::vector<std::int64_t> begin(count + 1, 0);
  for (const std::int32_t s : owner) ++begin[s + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::int64_t> next(begin.begin(), begin.end());
  std::vector<Item> sorted(items.size());
  for (std::size_t k = 0; k < items.size(); ++k) sorted[next[owner[k]]++] = items[k];
  items = std::move(sorted);
  return begin;
}

}  // namespace

AssemblyMap map_assembly(const Supernodes& supernodes, const BlockPattern& pattern) {
  const MapBuilder builder(supernodes, pattern.nodes());
  AssemblyMap map;
  std::vector<std::int32_t> block_owner, entry_owner;
  const auto add_block = [&](std::int64_t k, std::int64_t i, std::int64_t j) {
    const std::int32_t a = builder.rank(3 * i), b = builder.rank(3 * j), s = builder.owner(std::min(a, b));
    map.blocks.push_back(
        {static_cast<std::int32_t>(k), builder.row(s, std::max(a, b)), builder.row(s, std::min(a, b)), a < b});
    block_owner.push_back(s);
  };
  const auto add_entry = [&](std::int64_t k, std::int64_t dof_row, std::int64_t dof_column) {
    const std::int32_t a = builder.rank(dof_row), b = builder.rank(dof_column);
    if (a < 0 || b < 0) return;
    const std::int32_t s = builder.owner(std::min(a, b));
    map.entries.push_back({k, builder.row(s, std::max(a, b)), builder.row(s, std::min(a, b))});
    entry_owner.push_back(s);
  };
  for (std::int64_t j = 0; j < pattern.nodes(); ++j)
    for (std::int64_t k = pattern.column_begin()[j]; k < pattern.column_begin()[j + 1]; ++k) {
      const std::int64_t i = pattern.rows()[k];
      if (i != j && builder.free(i) && builder.free(j)) {
        add_block(k, i, j);
        continue;
      }
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < (i == j ? a + 1 : 3); ++b) add_entry(9 * k + 3 * a + b, 3 * i + a, 3 * j + b);
    }
  map.block_begin = group(map.blocks, block_owner, supernodes.count());
  map.entry_begin = group(map.entries, entry_owner, supernodes.count());
  return map;
}

}  // namespace qlb
