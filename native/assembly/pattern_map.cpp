#include "assembly/pattern_map.hpp"

#include <stdexcept>
#include <string>

namespace qlb {

PatternMap::PatternMap(std::shared_ptr<const BlockPattern> inner, std::shared_ptr<const BlockPattern> outer)
    : inner_(std::move(inner)), outer_(std::move(outer)) {
  if (inner_->nodes() != outer_->nodes())
    throw std::invalid_argument("the patterns have " + std::to_string(inner_->nodes()) + " and " +
                                std::to_string(outer_->nodes()) + " nodes");
  for (std::int64_t j = 0; j < inner_->nodes(); ++j) {
    std::int64_t at = outer_->column_begin()[j];
    const std::int64_t end = outer_->column_begin()[j + 1];
    for (std::int64_t k = inner_->column_begin()[j]; k < inner_->column_begin()[j + 1]; ++k, ++at) {
      const std::int32_t row = inner_->rows()[k];
      while (at < end && outer_->rows()[at] < row) ++at;
      if (at == end || outer_->rows()[at] != row)
        throw std::invalid_argument("the outer pattern lacks block (" + std::to_string(row) + ", " + std::to_string(j) +
                                    ") of the inner one");
      if (!runs_.empty() && runs_.back().outer + runs_.back().count == at)
        ++runs_.back().count;
      else
        runs_.push_back({k, at, 1});
    }
  }
}

}  // namespace qlb
