#include "io/checkpoint/checkpoint_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>
#include <system_error>
#include <type_traits>

#include "io/checkpoint/number_text.hpp"
#include "io/files/detail/all_or_none.hpp"
#include "io/files/detail/descriptor.hpp"
#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"

namespace talus::io {

namespace {

using detail::all_or_none;
using detail::demand;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;

static_assert(std::endian::native == std::endian::little, "rows are written as they stand in memory");

constexpr std::int64_t format_version = 9;

/// 64 bits of every byte and its place; no cryptography, but any flipped bit shows. The CRC-32 of
/// io/files/crc.hpp is as fast and would do for columns, too, but another checksum is another version of the
/// format: nobody could go on from the checkpoints there are, for twenty lines less. HDF5's own checksums of
/// data need datasets in chunks, into which ranks cannot write at a known place.
std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t hash = 0x9e3779b97f4a7c15ULL ^ bytes.size();
  const auto mix = [&hash](std::uint64_t word) {
    hash = std::rotl((hash ^ word) * 0xff51afd7ed558ccdULL, 29);
  };
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), 8);
    mix(word);
  }
  std::uint64_t rest = 0;
  if (!bytes.empty()) std::memcpy(&rest, bytes.data(), bytes.size());
  mix(rest);
  return hash;
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

template <class T>
struct Element {
  using Number = T;
  static constexpr std::size_t columns = 1;
};
template <class T, std::size_t N>
struct Element<std::array<T, N>> {
  using Number = T;
  static constexpr std::size_t columns = N;
};

/// A column of all parts, as it is laid out.
struct ColumnLayout {
  std::string name;
  hid_t type;
  std::size_t columns;
  std::size_t row_bytes;
};

std::vector<ColumnLayout> layout() {
  std::vector<ColumnLayout> columns;
  const CheckpointPart none;
  each_column(none, [&](const char* name, const auto& column) {
    using Row = typename std::remove_cvref_t<decltype(column)>::value_type;
    using Number = typename Element<Row>::Number;
    columns.push_back({name, detail::element_types(static_cast<const Number*>(nullptr)).file,
                       Element<Row>::columns, sizeof(Row)});
  });
  return columns;
}

/// What all ranks know of a column of one subdomain.
struct RowCount {
  std::int64_t subdomain, column, rows;
  std::uint64_t sum;
};

/// Of all subdomains, by subdomain and column.
std::vector<RowCount> count_rows(const Checkpoint& state, const std::vector<std::int32_t>& here,
                                 const graph::Communicator& ranks) {
  std::vector<RowCount> own;
  for (std::size_t e = 0; e < state.parts.size(); ++e) {
    std::int64_t number = 0;
    each_column(state.parts[e], [&](const char*, const auto& column) {
      own.push_back({here[e], number++, static_cast<std::int64_t>(column.size()),
                     checksum(std::as_bytes(std::span(column)))});
    });
  }
  std::vector<RowCount> all = ranks.gather_records(std::span<const RowCount>(own));
  std::ranges::sort(all, [](const RowCount& a, const RowCount& b) {
    return std::pair(a.subdomain, a.column) < std::pair(b.subdomain, b.column);
  });
  return all;
}

Hdf5Object create(Place place, const std::string& name, hid_t type, std::size_t rows, std::size_t columns) {
  const std::string action = "laying out " + name;
  const hsize_t extent[2] = {rows, columns};
  const Hdf5Object space =
      hold(H5Screate_simple(columns == 1 ? 1 : 2, extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object creation = hold(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, place.file, action);
  demand(H5Pset_fill_time(creation.id(), H5D_FILL_TIME_NEVER), place.file, action);
  demand(H5Pset_alloc_time(creation.id(), H5D_ALLOC_TIME_EARLY), place.file, action);
  return hold(
      H5Dcreate2(place.group, name.c_str(), type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT),
      H5Dclose, place.file, action);
}

/// A text as bytes: strings of any length are what damaged files hang readers with.
void write_bytes(Place place, const std::string& name, const std::string& text) {
  const Hdf5Object dataset = create(place, name, H5T_STD_U8LE, text.size(), 1);
  if (!text.empty())
    demand(H5Dwrite(dataset.id(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()), place.file,
           "writing " + name);
  detail::write_attribute({dataset.id(), place.file}, "sum",
                          std::bit_cast<std::int64_t>(checksum(bytes_of(text))));
}

std::string read_bytes(Place place, const std::string& name) {
  const std::vector<std::uint8_t> bytes = detail::read_array<std::uint8_t>(place, name);
  std::string text(bytes.begin(), bytes.end());
  const Hdf5Object dataset =
      hold(H5Dopen2(place.group, name.c_str(), H5P_DEFAULT), H5Dclose, place.file, "opening " + name);
  if (std::bit_cast<std::uint64_t>(detail::read_integer({dataset.id(), place.file}, "sum")) !=
      checksum(bytes_of(text)))
    throw FileError(place.file, name + " has another checksum: the file is damaged");
  return text;
}

/// Throws FileError where the disk has no room for so many bytes. Asked before HDF5 begins: a file whose
/// closing has failed stays open in the library, and crashes it at exit.
void demand_disk(const std::string& path, std::int64_t bytes) {
  detail::Descriptor file(path, O_WRONLY | O_CREAT | O_TRUNC);
  file.demand_room(0, bytes);
  file.close();
}

/// Of a file with these rows, and at least of what HDF5 puts around them.
std::int64_t expected_bytes(const CheckpointFile& content, const std::vector<RowCount>& rows) {
  constexpr std::int64_t around = 1 << 16;
  auto bytes = around + static_cast<std::int64_t>(content.run.size() + sizeof(RowCount) * rows.size());
  for (const auto& [name, text] : content.texts) bytes += static_cast<std::int64_t>(text.size());
  const std::vector<ColumnLayout> columns = layout();
  for (const RowCount& row : rows)
    bytes += row.rows * static_cast<std::int64_t>(columns[static_cast<std::size_t>(row.column)].row_bytes);
  return bytes;
}

/// Rank 0's part of the file. Returns where each column begins [byte]; -1 for one without rows.
std::vector<std::int64_t> lay_out(const std::string& path, const CheckpointFile& content,
                                  const std::vector<RowCount>& rows) {
  demand_disk(path, expected_bytes(content, rows));
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = detail::checked_file_access(path);
  Hdf5Object file =
      hold(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, path, "creating it");
  std::vector<std::int64_t> begin;
  {
    const Place root{file.id(), path};
    detail::write_attribute(root, "talus_checkpoint", format_version);
    NumberWriter head;
    each_member(content.state.head, head);
    write_bytes(root, "head", head.text());
    write_bytes(root, "run", content.run);
    const Hdf5Object texts = detail::create_group(root, "texts");
    std::string names;
    std::size_t number = 0;
    for (const auto& [name, text] : content.texts) {
      names += name + '\n';
      write_bytes({texts.id(), path}, fmt::format("{}", number++), text);
    }
    write_bytes({texts.id(), path}, "names", names);
    std::vector<std::array<std::int64_t, 4>> table;
    for (const RowCount& row : rows)
      table.push_back({row.subdomain, row.column, row.rows, std::bit_cast<std::int64_t>(row.sum)});
    detail::write_array(root, "rows", "1", table);
    write_bytes(root, "rows_sum", fmt::format("{}", checksum(std::as_bytes(std::span(table)))));
    const Hdf5Object parts = detail::create_group(root, "parts");
    std::vector<std::size_t> count(layout().size(), 0);
    for (const RowCount& row : rows)
      count[static_cast<std::size_t>(row.column)] += static_cast<std::size_t>(row.rows);
    std::size_t column = 0;
    for (const ColumnLayout& of : layout()) {
      const Hdf5Object dataset = create({parts.id(), path}, of.name, of.type, count[column], of.columns);
      begin.push_back(count[column] > 0 ? static_cast<std::int64_t>(H5Dget_offset(dataset.id())) : -1);
      ++column;
    }
  }
  detail::close_file(file, path);
  return begin;
}

void write_own_rows(const std::string& path, const Checkpoint& state, const std::vector<std::int32_t>& here,
                    const std::vector<RowCount>& rows, const std::vector<std::int64_t>& begin) {
  detail::Descriptor file(path, O_WRONLY);
  const std::size_t columns = begin.size();
  for (std::size_t e = 0; e < here.size(); ++e) {
    std::size_t number = 0;
    each_column(state.parts[e], [&](const char*, const auto& column) {
      using Row = typename std::remove_cvref_t<decltype(column)>::value_type;
      std::int64_t before = 0;
      for (std::size_t s = 0; s < at(here[e]); ++s) before += rows[s * columns + number].rows;
      if (!column.empty())
        file.write_at(begin[number] + before * static_cast<std::int64_t>(sizeof(Row)),
                      {reinterpret_cast<const char*>(column.data()), column.size() * sizeof(Row)});
      ++number;
    });
  }
  file.sync();
  file.close();
}

}  // namespace

std::int64_t write_checkpoint(const std::filesystem::path& path, const CheckpointFile& content,
                              const graph::Communicator& ranks) {
  const std::string unfinished = path.string().append(unfinished_ending);
  const bool first = ranks.rank() == 0;
  const std::vector<std::int32_t>& here = content.state.here;
  const std::vector<RowCount> rows = count_rows(content.state, here, ranks);
  std::vector<std::int64_t> begin;
  std::int64_t bytes = 0;
  try {
    all_or_none(ranks, unfinished, first, [&] { begin = lay_out(unfinished, content, rows); });
    begin = ranks.gather_records(std::span<const std::int64_t>(begin));
    all_or_none(ranks, unfinished, true,
                [&] { write_own_rows(unfinished, content.state, here, rows, begin); });
    all_or_none(ranks, unfinished, first, [&] {
      bytes = static_cast<std::int64_t>(std::filesystem::file_size(unfinished));
      std::filesystem::rename(unfinished, path);
      const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
      detail::Descriptor(folder, O_RDONLY | O_DIRECTORY).sync();
    });
  } catch (...) {
    std::error_code ignored;
    if (first) std::filesystem::remove(unfinished, ignored);
    throw;
  }
  return bytes;
}

namespace {

Hdf5Object open_checkpoint(const std::string& path) {
  Hdf5Object file = detail::open_checked_file(path);
  if (H5Aexists(file.id(), "talus_checkpoint") <= 0) throw FileError(path, "is no checkpoint of Talus");
  const std::int64_t version = detail::read_integer({file.id(), path}, "talus_checkpoint");
  if (version != format_version)
    throw FileError(path, fmt::format("has version {} of the format; this Talus reads version {}", version,
                                      format_version));
  return file;
}

std::vector<std::array<std::int64_t, 4>> read_rows(Place place) {
  const auto rows = detail::read_array<std::array<std::int64_t, 4>>(place, "rows", H5T_NATIVE_INT64, 4);
  if (fmt::format("{}", checksum(std::as_bytes(std::span(rows)))) != read_bytes(place, "rows_sum"))
    throw FileError(place.file, "rows has another checksum: the file is damaged");
  return rows;
}

/// Rows [begin, begin + count) of a dataset.
template <class Row>
std::vector<Row> read_rows_of(Place place, const std::string& name, std::size_t begin, std::size_t count) {
  if (count == 0) return {};
  using Number = typename Element<Row>::Number;
  constexpr std::size_t columns = Element<Row>::columns;
  const Hdf5Object dataset =
      hold(H5Dopen2(place.group, name.c_str(), H5P_DEFAULT), H5Dclose, place.file, "opening " + name);
  const std::size_t stored = detail::row_count(dataset.id(), columns, place.file, name);
  if (begin > stored || count > stored - begin)
    throw FileError(place.file, name + " is shorter than it says: the file is damaged");
  std::vector<Row> rows(count);
  const hsize_t start[2] = {begin, 0}, extent[2] = {count, columns};
  const int dimensions = columns == 1 ? 1 : 2;
  const std::string action = "reading " + name;
  const Hdf5Object there = hold(H5Dget_space(dataset.id()), H5Sclose, place.file, action);
  const Hdf5Object space = hold(H5Screate_simple(dimensions, extent, nullptr), H5Sclose, place.file, action);
  demand(H5Sselect_hyperslab(there.id(), H5S_SELECT_SET, start, nullptr, extent, nullptr), place.file,
         action);
  demand(H5Dread(dataset.id(), detail::element_types(static_cast<const Number*>(nullptr)).memory, space.id(),
                 there.id(), H5P_DEFAULT, rows.data()),
         place.file, action);
  return rows;
}

}  // namespace

CheckpointFile read_checkpoint_head(const std::filesystem::path& path) {
  const detail::QuietHdf5 quiet;
  const std::string name = path.string();
  const Hdf5Object file = open_checkpoint(name);
  const Place root{file.id(), name};
  CheckpointFile content;
  const NumberReader head(read_bytes(root, "head"), name);
  each_member(content.state.head, head);
  content.run = read_bytes(root, "run");
  std::string names = read_bytes(root, "texts/names");
  for (std::size_t number = 0; !names.empty(); ++number) {
    const std::size_t end = std::min(names.find('\n'), names.size());
    content.texts[names.substr(0, end)] = read_bytes(root, fmt::format("texts/{}", number));
    names.erase(0, end + 1);
  }
  return content;
}

std::vector<CheckpointPart> read_checkpoint_parts(const std::filesystem::path& path,
                                                  const std::vector<std::int32_t>& subdomains) {
  const detail::QuietHdf5 quiet;
  const std::string file_name = path.string();
  const Hdf5Object file = open_checkpoint(file_name);
  const Place root{file.id(), file_name};
  const auto rows = read_rows(root);
  const std::size_t columns = layout().size();
  std::vector<CheckpointPart> parts(subdomains.size());
  for (std::size_t e = 0; e < subdomains.size(); ++e) {
    std::size_t number = 0;
    each_column(parts[e], [&](const char* name, auto& column) {
      using Row = typename std::remove_cvref_t<decltype(column)>::value_type;
      const std::size_t own = at(subdomains[e]) * columns + number;
      if (own >= rows.size()) throw FileError(file_name, "lacks a subdomain: the file is damaged");
      std::size_t before = 0;
      for (std::size_t k = number; k < own; k += columns) before += static_cast<std::size_t>(rows[k][2]);
      column = read_rows_of<Row>({file.id(), file_name}, std::string("parts/") + name, before,
                                 static_cast<std::size_t>(rows[own][2]));
      if (checksum(std::as_bytes(std::span(column))) != std::bit_cast<std::uint64_t>(rows[own][3]))
        throw FileError(file_name, fmt::format("parts/{} has another checksum: the file is damaged", name));
      ++number;
    });
  }
  return parts;
}

}  // namespace talus::io
