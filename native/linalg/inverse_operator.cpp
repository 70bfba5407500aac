#include <vector>

#include "linalg/cholesky.hpp"

namespace qlb {

void InverseOperator::apply_split(const double* b, const RankOneTerms& terms, const double* beta, double* x,
                                  double* along) {
  const std::int64_t count = terms.size();
  std::vector<double> whole(b, b + size());
  terms.add_combination({beta, static_cast<std::size_t>(count)}, whole.data());
  apply(whole.data(), x);
  for (std::int64_t j = 0; j < count; ++j) along[j] = terms.dot(j, x);
}

}  // namespace qlb
