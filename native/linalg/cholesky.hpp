// What every sparse Cholesky factorisation offers: analyse once (in the constructor), then factorise and
// solve.
#pragma once

#include <cstdint>

#include "assembly/block_matrix.hpp"

namespace qlb {

// x = B^-1 b for some symmetric positive definite B: what L-BFGS starts from.
class InverseOperator {
 public:
  virtual ~InverseOperator() = default;
  virtual std::int64_t size() const = 0;
  virtual void apply(const double* b, double* x) = 0;
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
