#include "io/results/vti.hpp"

#include <fmt/format.h>

#include <vector>

#include "io/results/detail/base64.hpp"

namespace talus::io {
namespace {

/// An array inline, in base64: its length in bytes as a 64-bit integer, then `components` numbers a cell.
template <class Put>
void put_cells(const FieldGrid& field, std::string_view name, int components, const WriteText& out,
               const Put& put) {
  out(fmt::format(R"(<DataArray type="Float64" Name="{}" NumberOfComponents="{}" format="binary">)", name,
                  components));
  const std::size_t cells = field.grid.size();
  const std::uint64_t length[1] = {cells * static_cast<std::size_t>(components) * sizeof(double)};
  detail::Base64 base64(out);
  base64.add(std::as_bytes(std::span(length)));
  std::vector<double> numbers;
  for (std::size_t c = 0; c < cells; ++c) {
    put(fields_of(field.sums, c), numbers);
    if (numbers.size() < 4096 && c + 1 < cells) continue;
    base64.add(std::as_bytes(std::span(numbers)));
    numbers.clear();
  }
  base64.finish();
  out("</DataArray>\n");
}

void put_tensor(const Mat3& tensor, std::vector<double>& numbers) {
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) numbers.push_back(tensor(i, j));
}

}  // namespace

void write_field_vti(const FieldGrid& field, double time, const WriteText& out) {
  const Grid& grid = field.grid;
  const auto& [nx, ny, nz] = grid.cells;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", nx, ny, nz);
  out(fmt::format(
      R"(<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<ImageData WholeExtent="{0}" Origin="{1} {2} {3}" Spacing="{4} {5} {6}">
<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{7}</DataArray></FieldData>
<Piece Extent="{0}">
<CellData Scalars="density" Vectors="velocity">
)",
      extent, grid.low[0], grid.low[1], grid.low[2], grid.spacing[0], grid.spacing[1], grid.spacing[2],
      time));
  using Numbers = std::vector<double>;
  put_cells(field, "density", 1, out, [](const CellFields& f, Numbers& to) { to.push_back(f.density); });
  put_cells(field, "solid_fraction", 1, out,
            [](const CellFields& f, Numbers& to) { to.push_back(f.solid_fraction); });
  put_cells(field, "velocity", 3, out, [](const CellFields& f, Numbers& to) {
    to.insert(to.end(), f.velocity.begin(), f.velocity.end());
  });
  put_cells(field, "temperature", 1, out,
            [](const CellFields& f, Numbers& to) { to.push_back(f.temperature); });
  put_cells(field, "contact_stress", 9, out,
            [](const CellFields& f, Numbers& to) { put_tensor(f.contact_stress, to); });
  put_cells(field, "kinetic_stress", 9, out,
            [](const CellFields& f, Numbers& to) { put_tensor(f.kinetic_stress, to); });
  out("</CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n");
}

}  // namespace talus::io
