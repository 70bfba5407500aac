// Where the blocks of a pattern stand in a larger one of the same nodes.
#pragma once

#include <memory>
#include <vector>

#include "assembly/block_pattern.hpp"

namespace qlb {

class PatternMap {
 public:
  struct Run {  // blocks that follow each other in both
    std::int64_t inner, outer, count;
  };
  // Throws std::invalid_argument where outer lacks a block of inner.
  PatternMap(std::shared_ptr<const BlockPattern> inner, std::shared_ptr<const BlockPattern> outer);

  const BlockPattern& inner() const { return *inner_; }
  const BlockPattern& outer() const { return *outer_; }
  std::span<const Run> runs() const { return runs_; }  // ascending in both

 private:
  std::shared_ptr<const BlockPattern> inner_, outer_;
  std::vector<Run> runs_;
};

}  // namespace qlb
