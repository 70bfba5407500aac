// NumPy's view of vectors that an object keeps: use with nb::rv_policy::reference_internal.
#pragma once

#include <array>
#include <vector>

#include "bindings/bindings.hpp"

namespace qlb {

template <class T>
auto entries(const std::vector<T>& values) {
  return nb::ndarray<nb::numpy, const T, nb::ndim<1>>(values.data(), {values.size()});
}

template <class T, std::size_t width>
auto rows(const std::vector<std::array<T, width>>& values) {
  return nb::ndarray<nb::numpy, const T, nb::shape<-1, width>>(values.empty() ? nullptr : values[0].data(),
                                                               {values.size(), width});
}

}  // namespace qlb
