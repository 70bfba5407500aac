#include "bindings/bindings.hpp"

#include "contact/surface.hpp"

namespace qlb {
namespace {

template <class T, std::size_t width>
auto rows(const std::vector<std::array<T, width>>& values) {
  return nb::ndarray<nb::numpy, const T, nb::shape<-1, width>>(values.empty() ? nullptr : values[0].data(),
                                                               {values.size(), width});
}

void bind_surface(nb::module_& m) {
  nb::class_<ContactSurface>(m, "ContactSurface", "The triangles that may touch, and which bodies may touch which.")
      .def(
          "__init__",
          [](ContactSurface* self, const Array<const double>& rest, const Array<const std::int32_t>& faces,
             const Array<const std::int32_t>& group, const Array<const std::uint8_t>& allowed) {
            new (self) ContactSurface(view(rest), view(faces), view(group), view(allowed));
          },
          nb::arg("rest"), nb::arg("faces"), nb::arg("group"), nb::arg("allowed"))
      .def_prop_ro(
          "faces", [](const ContactSurface& s) { return rows(s.faces()); }, nb::rv_policy::reference_internal)
      .def_prop_ro(
          "edges", [](const ContactSurface& s) { return rows(s.edges()); }, nb::rv_policy::reference_internal)
      .def_prop_ro(
          "vertices",
          [](const ContactSurface& s) {
            return nb::ndarray<nb::numpy, const std::int32_t, nb::ndim<1>>(s.vertices().data(), {s.vertices().size()});
          },
          nb::rv_policy::reference_internal)
      .def("node_area", &ContactSurface::node_area, nb::arg("node"))
      .def("edge_area", &ContactSurface::edge_area, nb::arg("edge"));
}

}  // namespace

void bind_contact(nb::module_& m) {
  bind_surface(m);
}

}  // namespace qlb
