// Linear tetrahedra laid out for SIMD and threads.
//
// Elements are sorted along a Morton curve and cut into chunks of some hundred neighbours. A chunk keeps its
// own small copy of its nodes (`slots`) and of its node pairs (`block slots`), so that its sums stay in cache
// and no two threads ever write to one place. A second pass adds the slots of each node (each block) in a
// fixed order: the result is the same, bit for bit, for any number of threads. Within a chunk, elements come
// in packs of kLanes, with lanes as the fastest index; the last pack is filled up with copies of volume zero.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "assembly/block_pattern.hpp"
#include "elements/kernels.hpp"
#include "elements/lanes.hpp"
#include "simd/aligned.hpp"

namespace qlb {

// For each target (a node, a block) the slots that add up to it.
struct SlotLists {
  std::vector<std::int64_t> begin;  // targets + 1
  std::vector<std::int32_t> slot;
};

struct Chunk {
  std::int64_t first_pack, packs;
  std::int64_t first_slot, slots;
  std::int64_t first_block_slot, block_slots;
};

struct TetBlocks {
  // positions (nodes, 3), tets (elements, 4). The rest volume must not be zero; orientation does not matter
  // here.
  TetBlocks(std::span<const double> rest_positions, std::span<const std::int32_t> tets, const BlockPattern& pattern);

  std::int64_t nodes = 0, elements = 0;
  std::vector<Chunk> chunks;
  Aligned<std::int64_t> vertex;         // (packs, 4, kLanes): slot within the chunk
  Aligned<std::int32_t> pair;           // (packs, kPairs, kLanes): block slot within the chunk
  Aligned<double> shape;                // (packs, 9, kLanes): inverse of the rest edge matrix Dm, row by row [1/m]
  Aligned<double> volume;               // (packs, kLanes): rest volume [m^3]
  std::vector<std::int32_t> source;     // (packs, kLanes): which element of the input stands in this lane
  std::vector<std::int32_t> slot_node;  // global node of each slot
  SlotLists node_slots;                 // over nodes
  SlotLists block_slots;                // over blocks of the pattern

  std::int64_t packs() const { return static_cast<std::int64_t>(volume.size()) / kLanes; }
  // Per-element values (elements, width) laid out as (packs, width, kLanes).
  Aligned<double> scatter(std::span<const double> values, std::int64_t width) const;
};

// One chunk for the kernels, without parameters.
ChunkData chunk_geometry(const TetBlocks& blocks, const Chunk& chunk);

}  // namespace qlb
