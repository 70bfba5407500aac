#include "elements/tet_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace qlb {
namespace {

constexpr std::int64_t kChunkPacks = 64;  // 512 elements: sums stay in L1/L2, and small meshes still feed every core

std::uint64_t spread_bits(std::uint64_t v) {  // 21 bits to every third bit
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffULL;
  v = (v | v << 16) & 0x1f0000ff0000ffULL;
  v = (v | v << 8) & 0x100f00f00f00f00fULL;
  v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
  return (v | v << 2) & 0x1249249249249249ULL;
}

// Elements along a Morton curve through their centroids, in the box of their nodes: others (those of obstacles) have no
// say in the order, and so in no sum.
std::vector<std::int32_t> morton_order(std::span<const double> x, std::span<const std::int32_t> tets) {
  const std::size_t count = tets.size() / 4;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const std::int32_t node : tets)
    for (int c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], x[3 * node + c]);
      high[c] = std::max(high[c], x[3 * node + c]);
    }
  const double extent = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-300});
  std::vector<std::uint64_t> code(count, 0);
  for (std::size_t e = 0; e < count; ++e)
    for (int c = 0; c < 3; ++c) {
      double centre = 0.0;
      for (int a = 0; a < 4; ++a) centre += 0.25 * (x[3 * tets[4 * e + a] + c] - low[c]);
      code[e] |= spread_bits(static_cast<std::uint64_t>(centre / extent * 2097151.0)) << c;
    }
  std::vector<std::int32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return code[a] < code[b]; });
  return order;
}

struct RestShape {
  std::array<double, 9> inverse;
  double volume;
};

RestShape rest_shape(std::span<const double> x, const std::array<std::int32_t, 4>& tet) {
  double D[3][3];
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c) D[c][a] = x[3 * tet[a + 1] + c] - x[3 * tet[0] + c];
  RestShape rest;
  const auto cofactor = [&](int i, int j) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    return D[i1][j1] * D[i2][j2] - D[i1][j2] * D[i2][j1];
  };
  const double det = D[0][0] * cofactor(0, 0) + D[0][1] * cofactor(0, 1) + D[0][2] * cofactor(0, 2);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rest.inverse[3 * i + j] = cofactor(j, i) / det;
  rest.volume = std::abs(det) / 6.0;
  return rest;
}

SlotLists invert(const std::vector<std::int32_t>& target, std::int64_t targets) {
  SlotLists lists;
  lists.begin.assign(targets + 1, 0);
  for (const std::int32_t t : target) ++lists.begin[t + 1];
  for (std::int64_t t = 0; t < targets; ++t) lists.begin[t + 1] += lists.begin[t];
  lists.slot.resize(target.size());
  std::vector<std::int64_t> next(lists.begin.begin(), lists.begin.end() - 1);
  for (std::size_t s = 0; s < target.size(); ++s) lists.slot[next[target[s]]++] = static_cast<std::int32_t>(s);
  return lists;
}

// Replaces the global ids in `ids` by their rank among this chunk's distinct ids, which are appended to
// `all`.
template <class Index>
std::int64_t localise(std::span<Index> ids, std::vector<std::int32_t>& all) {
  std::vector<Index> unique(ids.begin(), ids.end());
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  for (Index& id : ids) id = static_cast<Index>(std::lower_bound(unique.begin(), unique.end(), id) - unique.begin());
  all.insert(all.end(), unique.begin(), unique.end());
  return static_cast<std::int64_t>(unique.size());
}

}  // namespace

TetBlocks::TetBlocks(std::span<const double> rest_positions, std::span<const std::int32_t> tets,
                     const BlockPattern& pattern)
    : nodes(static_cast<std::int64_t>(rest_positions.size()) / 3),
      elements(static_cast<std::int64_t>(tets.size()) / 4) {
  const std::vector<std::int32_t> order = morton_order(rest_positions, tets);
  const std::int64_t pack_count = (elements + kLanes - 1) / kLanes;
  vertex.resize(pack_count * 4 * kLanes);
  pair.resize(pack_count * kPairs * kLanes);
  shape.resize(pack_count * 9 * kLanes);
  volume.resize(pack_count * kLanes);
  source.resize(pack_count * kLanes);

  for (std::int64_t k = 0; k < pack_count * kLanes; ++k) {
    const std::int64_t pack = k / kLanes, lane = k % kLanes;
    const std::int32_t e = order[std::min(k, elements - 1)];
    // Vertices ascending, so that each pair (a, b), a < b, is block (b, a) of the lower triangle. The
    // deformation gradient does not depend on the order of the vertices.
    std::array<std::int32_t, 4> tet;
    std::copy_n(tets.begin() + 4 * e, 4, tet.begin());
    std::sort(tet.begin(), tet.end());
    const RestShape rest = rest_shape(rest_positions, tet);
    source[k] = e;
    volume[k] = k < elements ? rest.volume : 0.0;
    for (int i = 0; i < 9; ++i) shape[(pack * 9 + i) * kLanes + lane] = rest.inverse[i];
    for (int a = 0, p = 0; a < 4; ++a) {
      vertex[(pack * 4 + a) * kLanes + lane] = tet[a];
      for (int b = a; b < 4; ++b, ++p)
        pair[(pack * kPairs + p) * kLanes + lane] = static_cast<std::int32_t>(pattern.find(tet[b], tet[a]));
    }
  }

  std::vector<std::int32_t> slot_block;
  for (std::int64_t first = 0; first < pack_count; first += kChunkPacks) {
    Chunk chunk;
    chunk.first_pack = first;
    chunk.packs = std::min(kChunkPacks, pack_count - first);
    chunk.first_slot = static_cast<std::int64_t>(slot_node.size());
    chunk.first_block_slot = static_cast<std::int64_t>(slot_block.size());
    const auto count = static_cast<std::size_t>(chunk.packs) * kLanes;
    chunk.slots = localise(std::span(vertex).subspan(first * 4 * kLanes, 4 * count), slot_node);
    chunk.block_slots = localise(std::span(pair).subspan(first * kPairs * kLanes, kPairs * count), slot_block);
    chunks.push_back(chunk);
  }
  node_slots = invert(slot_node, nodes);
  block_slots = invert(slot_block, pattern.blocks());
}

Aligned<double> TetBlocks::scatter(std::span<const double> values, std::int64_t width) const {
  Aligned<double> out(source.size() * width);
  for (std::size_t k = 0; k < source.size(); ++k)
    for (std::int64_t i = 0; i < width; ++i)
      out[(k / kLanes * width + i) * kLanes + k % kLanes] = values[source[k] * width + i];
  return out;
}

ChunkData chunk_geometry(const TetBlocks& blocks, const Chunk& chunk) {
  return {blocks.vertex.data() + chunk.first_pack * 4 * kLanes,
          blocks.pair.data() + chunk.first_pack * kPairs * kLanes,
          blocks.shape.data() + chunk.first_pack * 9 * kLanes,
          blocks.volume.data() + chunk.first_pack * kLanes,
          nullptr,
          chunk.packs,
          blocks.slot_node.data() + chunk.first_slot,
          chunk.slots,
          chunk.block_slots,
          nullptr};
}

}  // namespace qlb
