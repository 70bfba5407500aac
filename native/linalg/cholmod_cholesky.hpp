// Supernodal Cholesky through CHOLMOD (Chen, Davis, Hager, Rajamanickam 2008), in double precision.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linalg/cholesky.hpp"

namespace qlb {

class CholmodCholesky : public Cholesky {
 public:
  // fixed: (nodes, 3), nonzero where a degree of freedom is held. Throws std::bad_alloc or
  // std::runtime_error.
  CholmodCholesky(std::shared_ptr<const BlockPattern> pattern, std::span<const std::uint8_t> fixed, int threads);
  ~CholmodCholesky() override;
  CholmodCholesky(const CholmodCholesky&) = delete;
  CholmodCholesky& operator=(const CholmodCholesky&) = delete;

  std::int64_t size() const override { return 3 * pattern_->nodes(); }
  std::int64_t factorise(const BlockMatrix& matrix) override;
  void apply(const double* b, double* x) override;
  std::int64_t factor_nonzeros() const override { return factor_nonzeros_; }
  double factor_flops() const override { return factor_flops_; }

 private:
  struct State;  // CHOLMOD's own types stay out of this header
  std::int64_t first_not_finite() const;
  void build_matrix(std::span<const std::uint8_t> fixed);

  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<std::int64_t> dof_;    // degree of freedom of each row of the matrix, in elimination order
  std::vector<std::int64_t> entry_;  // where in BlockMatrix::values() each entry of the matrix comes from
  std::int64_t factor_nonzeros_ = 0;
  double factor_flops_ = 0.0;
  bool ready_ = false;
  int threads_, blas_threads_ = 1;
  std::unique_ptr<State> state_;
};

}  // namespace qlb
