#pragma once

/// The parts of a trace file, each as a group or a data set of HDF5 (docs/formats.md): written, and read
/// back. Reading throws FileError, which names the file, where lengths do not agree or a value means nothing.

#include <cstdint>
#include <string>
#include <vector>

#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/trace/trace_file.hpp"

namespace talus::io::detail {

/// trace::Record as it lies in the file, little endian.
Hdf5Object record_type(const std::string& file);

void write_kinds(Place place, const std::vector<trace::KindInfo>& kinds);
void write_tasks(Place place, std::int32_t rank, const std::vector<trace::Task>& tasks);
void write_plan(Place place, const trace::Plan& plan);
void write_machine(Place place, const trace::Machine& machine);

/// Throws FileError: the file is damaged, and where.
[[noreturn]] void damaged_trace(const std::string& file, const std::string& what);

/// A group of the file, for reading.
Hdf5Object open_group(Place place, const std::string& name);

std::vector<trace::KindInfo> read_kinds(Place place);
trace::Machine read_machine(Place place);
std::vector<trace::Task> read_tasks(Place place);
trace::Plan read_plan(Place place);
/// Of the group `name` below `root`.
trace::Block read_records(Place root, const std::string& name);
RankClock read_clock(Place root, const std::string& name);

}  // namespace talus::io::detail
