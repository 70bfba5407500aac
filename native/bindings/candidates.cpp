#include "bindings/bindings.hpp"

#include "contact/candidates.hpp"

namespace qlb {
namespace {

using Pairs = nb::ndarray<nb::numpy, const std::int32_t, nb::shape<-1, 2>>;
using Stencils = nb::ndarray<nb::numpy, const std::int32_t, nb::shape<-1, 4>>;

// A copy.
nb::typed<nb::object, Pairs> pair_array(const std::vector<Pair>& pairs) {
  static const Pair none{};
  return nb::cast(Pairs(pairs.empty() ? none.data() : pairs[0].data(), {pairs.size(), 2}), nb::rv_policy::copy);
}

const double* nodal(const Candidates& c, const Array<const double>& values, const char* name) {
  return sized(values, 3 * c.surface().nodes(), name);
}

}  // namespace

void bind_candidates(nb::module_& m) {
  nb::class_<Candidates>(m, "Candidates",
                         "Pairs of primitives of a ContactSurface that may come near each other: the broad phase, kept "
                         "while the surface stays in the boxes it was built for, and collision detection on it.")
      .def(
          "__init__",
          [](Candidates* self, std::shared_ptr<ContactSurface> surface, int threads) {
            new (self) Candidates(std::move(surface), threads);
          },
          nb::arg("surface"), nb::arg("threads"))
      .def(
          "build",
          [](Candidates& c, const Array<const double>& x, const Array<const double>& p, double margin, double radius) {
            c.build(nodal(c, x, "x"), nodal(c, p, "p"), margin, radius);
          },
          nb::arg("x"), nb::arg("p"), nb::arg("margin"), nb::arg("radius"), ReleaseGil(),
          "Lists the pairs that may come within radius [m] of each other while every vertex stays within margin [m], "
          "by coordinate, of the box of its path x -> x + p, both (n, 3) [m]. Clamp p first: a long one lists all.")
      .def(
          "covers",
          [](const Candidates& c, const Array<const double>& x, const Array<const double>& p) {
            return c.covers(nodal(c, x, "x"), nodal(c, p, "p"));
          },
          nb::arg("x"), nb::arg("p"), ReleaseGil(), "Whether the lists are complete along all of x -> x + p.")
      .def_prop_ro(
          "vertex_faces", [](const Candidates& c) { return pair_array(c.vertex_faces()); },
          "Node and face of each pair, shape (k, 2), a copy.")
      .def_prop_ro(
          "edge_edges", [](const Candidates& c) { return pair_array(c.edge_edges()); },
          "Edges of each pair, the lower number first, shape (l, 2), a copy.")
      .def(
          "step_bound",
          [](Candidates& c, const Array<const double>& x, const Array<const double>& p) {
            return c.step_bound(nodal(c, x, "x"), nodal(c, p, "p"));
          },
          nb::arg("x"), nb::arg("p"), ReleaseGil(),
          "The largest step in (0, 1] found for which every listed pair keeps at least the fraction `slack` of its "
          "distance at x all along x + step p. 0 only if a pair touches at x. True of all pairs where covers(x, p).")
      .def_prop_ro(
          "limiting",
          [](const Candidates& c) -> nb::object {
            if (!c.limited()) return nb::none();
            return nb::cast(nb::ndarray<nb::numpy, const std::int32_t, nb::shape<4>>(c.limiting().data(), {4}),
                            nb::rv_policy::copy);
          },
          "Nodes (4,) of the pair that bounded the last step_bound, None if that was 1.")
      .def_prop_rw("slack", &Candidates::slack, &Candidates::set_slack,
                   "Fraction of its distance that a pair keeps in a step, between 0 and 1.")
      .def(
          "minimum_distance",
          [](const Candidates& c, const Array<const double>& x) { return c.minimum_distance(nodal(c, x, "x")); },
          nb::arg("x"), ReleaseGil(), "Least distance [m] of the listed pairs at x; infinite if none is listed.")
      .def(
          "near",
          [](const Candidates& c, const Array<const double>& x, double radius) -> nb::typed<nb::object, Stencils> {
            const auto found = c.near(nodal(c, x, "x"), radius);
            static const std::array<std::int32_t, 4> none{};
            return nb::cast(Stencils(found.empty() ? none.data() : found[0].data(), {found.size(), 4}),
                            nb::rv_policy::copy);
          },
          nb::arg("x"), nb::arg("radius"),
          "Nodes of the listed pairs that are nearer than radius [m] at x (n, 3) [m], shape (k, 4), a copy.")
      .def(
          "intersections",
          [](Candidates& c, const Array<const double>& x) {
            const double* at = nodal(c, x, "x");
            std::vector<Pair> found;
            {
              nb::gil_scoped_release release;
              found = c.intersections(at);
            }
            return pair_array(found);
          },
          nb::arg("x"),
          "Edge and face of each pair that cross or touch at x, shape (k, 2). Changes no list of candidates.");
}

}  // namespace qlb
