#include "bindings/bindings.hpp"

#include "linalg/cholmod_cholesky.hpp"
#include "linalg/lbfgs.hpp"
#include "linalg/rotated_inverse.hpp"
#include "linalg/vector_ops.hpp"

namespace qlb {

void bind_linalg(nb::module_& m) {
  nb::class_<InverseOperator>(m, "InverseOperator", "x = B^-1 b for a symmetric positive definite B.")
      .def(
          "apply",
          [](InverseOperator& op, const Array<const double>& b, const Array<double>& x) {
            op.apply(sized(b, op.size(), "b"), sized(x, op.size(), "x"));
          },
          nb::arg("b"), nb::arg("x").noconvert(), ReleaseGil());

  nb::class_<Cholesky, InverseOperator>(m, "Cholesky", "Sparse Cholesky factor: analysed once, factorised many times.")
      .def("factorise", &Cholesky::factorise, nb::arg("matrix"), ReleaseGil(),
           "Factorises; returns -1, or the degree of freedom (3 node + axis) whose pivot is not positive.")
      .def_prop_ro("factor_nonzeros", &Cholesky::factor_nonzeros)
      .def_prop_ro("factor_flops", &Cholesky::factor_flops);

  nb::class_<CholmodCholesky, Cholesky>(m, "CholmodCholesky")
      .def(
          "__init__",
          [](CholmodCholesky* self, std::shared_ptr<BlockPattern> pattern, const Array<const std::uint8_t>& fixed,
             int threads) { new (self) CholmodCholesky(std::move(pattern), view(fixed), threads); },
          nb::arg("pattern"), nb::arg("fixed"), nb::arg("threads"), ReleaseGil());

  nb::class_<RotatedInverse, InverseOperator>(m, "RotatedInverse", "An inverse carried along by nodal rotations.")
      .def(
          "__init__",
          [](RotatedInverse* self, std::shared_ptr<InverseOperator> inner, std::shared_ptr<TetBlocks> blocks,
             const Array<const std::uint8_t>& fixed,
             int threads) { new (self) RotatedInverse(std::move(inner), std::move(blocks), view(fixed), threads); },
          nb::arg("inner"), nb::arg("blocks"), nb::arg("fixed"), nb::arg("threads"))
      .def(
          "turn",
          [](RotatedInverse& op, const Array<const double>& x, const Array<const double>& reference) {
            op.turn(sized(x, op.size(), "x"), sized(reference, op.size(), "reference"));
          },
          nb::arg("x"), nb::arg("reference"), ReleaseGil())
      .def("reset", &RotatedInverse::reset);

  nb::class_<Lbfgs>(m, "Lbfgs", "Limited-memory BFGS around an inner inverse (Nocedal, Wright 2006, algorithm 7.4).")
      .def(nb::init<std::int64_t, int, int>(), nb::arg("size"), nb::arg("window"), nb::arg("threads"))
      .def_prop_ro("pairs", &Lbfgs::pairs)
      .def("clear", &Lbfgs::clear)
      .def(
          "push",
          [](Lbfgs& h, const Array<const double>& x_old, const Array<const double>& x, const Array<const double>& g_old,
             const Array<const double>& g) {
            return h.push(sized(x_old, h.size(), "x_old"), sized(x, h.size(), "x"), sized(g_old, h.size(), "g_old"),
                          sized(g, h.size(), "g"));
          },
          nb::arg("x_old"), nb::arg("x"), nb::arg("g_old"), nb::arg("g"), ReleaseGil())
      .def(
          "direction",
          [](Lbfgs& h, const Array<const double>& g, InverseOperator& inner, const Array<double>& p) {
            if (inner.size() != h.size()) throw std::invalid_argument("the inner inverse has another size");
            return h.direction(sized(g, h.size(), "g"), inner, sized(p, h.size(), "p"));
          },
          nb::arg("g"), nb::arg("inner"), nb::arg("p").noconvert(), ReleaseGil());

  m.def(
      "dot",
      [](const Array<const double>& a, const Array<const double>& b, int threads) {
        return dot(a.data(), sized(b, a.size(), "b"), a.size(), threads);
      },
      nb::arg("a"), nb::arg("b"), nb::arg("threads"), ReleaseGil());
}

}  // namespace qlb
