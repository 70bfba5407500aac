#include <vector>

#include "linalg/cholesky.hpp"

namespace qlb {

void InverseOperator::apply_split(const double* b, const RankOneTerms& terms, std::span<const std::int32_t> which,
                                  const double* beta, double* x, double* along) {
  std::vector<double> whole(b, b + size());
  for (std::size_t k = 0; k < which.size(); ++k) terms.add_to(which[k], beta[k], whole.data());
  apply(whole.data(), x);
  for (std::size_t k = 0; k < which.size(); ++k) along[k] = terms.dot(which[k], x);
}

}  // namespace qlb
