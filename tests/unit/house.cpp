// Dependencies point downward only (docs/decisions/0001-house.md). Includes are root-relative, so the
// compiler would accept any edge between folders; this test reads the #include lines.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace talus {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 5> folders{"kernels", "partition", "runtime", "io",
                                                  "apps"};  // from the ground up

/// Floor of the folder that `path`, relative to the root, lies in; none if outside the house.
std::optional<std::size_t> floor_of(std::string_view path) {
  for (std::size_t k = 0; k < folders.size(); ++k)
    if (path.starts_with(folders[k]) && path.substr(folders[k].size()).starts_with('/')) return k;
  return {};
}

bool in_room(std::string_view path, std::string_view room) {
  return path.starts_with(room);
}

/// What is wrong with `file` including `header`, or "".
std::string fault(std::string_view file, std::string_view header) {
  const auto own = floor_of(file), other = floor_of(header);
  if (own && other && *other > *own) return "includes upward";
  for (std::string_view room : {"runtime/graph/", "runtime/trace/"})
    if (in_room(file, room) && other && !in_room(header, "runtime/graph/") &&
        !in_room(header, "runtime/trace/"))
      return "knows physics";
  if (in_room(file, "kernels/"))
    for (std::string_view banned : {"mpi.h", "omp.h", "hdf5.h", "fstream", "filesystem", "iostream", "cstdio",
                                    "thread", "mutex", "atomic", "future", "condition_variable"})
      if (header == banned) return "kernels know no MPI, no threads, no files";
  return "";
}

/// The name between quotes or brackets if the line includes something.
std::optional<std::string> included(std::string_view line) {
  const auto skip = [&line] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
  skip();
  if (!line.starts_with('#')) return {};
  line.remove_prefix(1);
  skip();
  if (!line.starts_with("include")) return {};
  line.remove_prefix(7);
  skip();
  if (line.empty() || (line[0] != '"' && line[0] != '<')) return {};
  const std::size_t end = line.find(line[0] == '"' ? '"' : '>', 1);
  if (end == std::string_view::npos) return {};
  return std::string(line.substr(1, end - 1));
}

TEST(House, NoFileIncludesUpward) {
  const fs::path root = TALUS_SOURCE_DIR;
  std::size_t files = 0;
  for (std::string_view folder : folders) {
    if (!fs::exists(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cpp" && extension != ".hpp" && extension != ".h") continue;
      ++files;
      const std::string file = fs::relative(entry.path(), root).generic_string();
      std::ifstream lines(entry.path());
      std::string line;
      if (extension == ".hpp") {
        std::getline(lines, line);
        EXPECT_EQ(line, "#pragma once") << file << ": may be included twice";
        lines.seekg(0);
      }
      for (int number = 1; std::getline(lines, line); ++number) {
        const auto header = included(line);
        if (!header) continue;
        const std::string what = fault(file, *header);
        EXPECT_EQ(what, "") << file << ":" << number << ": " << line;
        // A path relative to the including file would hide the edge from this test.
        const bool quoted = line.find('"') < line.find('<');
        EXPECT_TRUE(!quoted || floor_of(*header))
            << file << ":" << number << ": not a path from the root: " << line;
      }
    }
  }
  EXPECT_GT(files, 10u);
}

TEST(House, TheCheckSeesEveryKindOfForbiddenEdge) {
  EXPECT_NE(fault("kernels/a.hpp", "io/scene/scene.hpp"), "");
  EXPECT_NE(fault("partition/a.hpp", "runtime/graph/graph.hpp"), "");
  EXPECT_NE(fault("runtime/step/a.cpp", "io/scene/scene.hpp"), "");
  EXPECT_NE(fault("runtime/graph/a.cpp", "kernels/bodies/bodies.hpp"), "");
  EXPECT_NE(fault("runtime/trace/a.cpp", "partition/boxes.hpp"), "");
  EXPECT_NE(fault("runtime/graph/a.cpp", "runtime/step/setup.hpp"), "");
  EXPECT_NE(fault("kernels/a.cpp", "mpi.h"), "");
  EXPECT_NE(fault("kernels/a.cpp", "fstream"), "");
}

TEST(House, TheCheckLetsDownwardEdgesPass) {
  EXPECT_EQ(fault("apps/commands/run.cpp", "io/scene/scene.hpp"), "");
  EXPECT_EQ(fault("runtime/step/a.cpp", "runtime/graph/graph.hpp"), "");
  EXPECT_EQ(fault("runtime/graph/a.cpp", "runtime/graph/graph.hpp"), "");
  EXPECT_EQ(fault("runtime/graph/a.cpp", "atomic"), "");
  EXPECT_EQ(fault("kernels/a.cpp", "cmath"), "");
}

TEST(House, IncludeLinesAreReadHoweverTheyAreSpaced) {
  EXPECT_EQ(included("#include \"io/a.hpp\"").value_or(""), "io/a.hpp");
  EXPECT_EQ(included("  #  include<mpi.h>  // why").value_or(""), "mpi.h");
  EXPECT_FALSE(included("// #include <mpi.h>"));
  EXPECT_FALSE(included("#pragma once"));
}

}  // namespace
}  // namespace talus
