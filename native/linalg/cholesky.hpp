// What every sparse Cholesky factorisation offers: analyse once (in the constructor), then factorise and
// solve.
#pragma once

#include <cstdint>
#include <span>

#include "assembly/block_matrix.hpp"
#include "linalg/rank_one_terms.hpp"

namespace qlb {

// x = B^-1 b for some symmetric positive definite B: what L-BFGS starts from.
class InverseOperator {
 public:
  virtual ~InverseOperator() = default;
  virtual std::int64_t size() const = 0;
  virtual void apply(const double* b, double* x) = 0;
  // x = B^-1 (b + C beta) and along = C^T x for the directions C of those of the `terms` that `which` lists. Where they
  // are part of B and stiff, beta is to be kept apart: its large forces would drown the rest of b.
  virtual void apply_split(const double* b, const RankOneTerms& terms, std::span<const std::int32_t> which,
                           const double* beta, double* x, double* along);
};

// The matrix is that of the free degrees of freedom; vectors are full length, and zero where a node is held.
class Cholesky : public InverseOperator {
 public:
  static constexpr std::int64_t kPositiveDefinite = -1;
  // Returns kPositiveDefinite, or the degree of freedom (3 node + axis) whose pivot is not positive or not a number.
  virtual std::int64_t factorise(const BlockMatrix& matrix) = 0;
  virtual std::int64_t factor_nonzeros() const = 0;
  virtual double factor_flops() const = 0;
};

}  // namespace qlb
