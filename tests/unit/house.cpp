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

/// The rooms of `kernels`, `io` and `apps`, from the ground up, and the rooms of the same folder that each
/// may include: none that stands below it in this list, so that no two need one another.
struct Room {
  std::string_view name;
  std::vector<std::string_view> may_include;
};
const std::vector<Room>& rooms() {
  static const std::vector<Room> all = {
      {"kernels/simd", {}},
      {"kernels/bodies", {}},
      {"kernels/law", {"kernels/simd", "kernels/bodies"}},
      {"kernels/shapes", {"kernels/bodies"}},
      {"kernels/detection", {"kernels/simd", "kernels/bodies", "kernels/law", "kernels/shapes"}},
      {"kernels/sweeps",
       {"kernels/simd", "kernels/bodies", "kernels/law", "kernels/shapes", "kernels/detection"}},
      {"kernels/global", {"kernels/bodies", "kernels/law", "kernels/shapes", "kernels/detection"}},
      {"kernels/delassus", {"kernels/bodies", "kernels/law", "kernels/shapes", "kernels/detection"}},
      {"kernels/clusters", {"kernels/bodies", "kernels/law", "kernels/global", "kernels/delassus"}},
      {"kernels/fields", {"kernels/bodies"}},
      {"kernels/samples", {"kernels/simd", "kernels/bodies", "kernels/shapes", "kernels/detection"}},
      {"io/files", {}},
      {"io/fclib", {"io/files"}},
      {"io/results", {"io/files"}},
      {"io/trace", {"io/files", "io/results"}},
      {"io/pictures", {"io/files", "io/results", "io/trace"}},
      {"io/output", {"io/files", "io/results", "io/pictures"}},
      {"io/checkpoint", {"io/files"}},
      {"io/scene", {"io/files", "io/results", "io/output"}},
      {"apps/shared", {}},
      {"apps/study_error", {"apps/shared"}},
      {"apps/study_scaling", {"apps/shared"}},
      {"apps/study_stability", {"apps/shared"}},
      {"apps/study_certificate", {"apps/shared"}},
      {"apps/validate", {"apps/shared"}},
      {"apps/report", {"apps/shared"}},
      {"apps/commands",
       {"apps/shared", "apps/study_error", "apps/study_scaling", "apps/study_stability",
        "apps/study_certificate", "apps/validate", "apps/report"}},
  };
  return all;
}

/// "kernels/bodies" of "kernels/shapes/walls.hpp"; "" for a file that lies in no room of its folder.
std::string_view room_of(std::string_view path) {
  const std::size_t folder = path.find('/');
  const std::size_t room = folder == std::string_view::npos ? folder : path.find('/', folder + 1);
  return room == std::string_view::npos ? std::string_view() : path.substr(0, room);
}

/// Whether the rooms of the folder that `path` lies in are declared.
bool has_rooms(std::string_view path) {
  return path.starts_with("kernels/") || path.starts_with("io/") || path.starts_with("apps/");
}

/// What is wrong with a file of one room including a header of another one of the same folder, or "".
std::string room_fault(std::string_view file, std::string_view header) {
  const std::string_view own = room_of(file), other = room_of(header);
  if (!has_rooms(file) || own.empty() || other.empty() || own == other) return "";
  if (own.substr(0, own.find('/')) != other.substr(0, other.find('/'))) return "";
  const auto room =
      std::find_if(rooms().begin(), rooms().end(), [&](const Room& r) { return r.name == own; });
  if (room == rooms().end()) return "is in a room that tests/unit/house.cpp does not know";
  const bool may =
      std::find(room->may_include.begin(), room->may_include.end(), other) != room->may_include.end();
  return may ? "" : std::string(own) + " may not include " + std::string(other);
}

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
  if (const std::string what = room_fault(file, header); !what.empty()) return what;
  for (std::string_view room : {"runtime/graph/", "runtime/trace/"})
    if (in_room(file, room) && other && !in_room(header, "runtime/graph/") &&
        !in_room(header, "runtime/trace/"))
      return "knows physics";
  if (in_room(file, "apps/study_certificate/") && header != "kernels/law/pair_table.hpp")
    for (std::string_view room : {"kernels/law/", "kernels/sweeps/", "kernels/global/", "kernels/delassus/"})
      if (in_room(header, room)) return "a judge shares no code with what it judges";
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

TEST(House, RoomsIncludeOneAnotherInOneDirectionOnly) {
  for (std::size_t k = 0; k < rooms().size(); ++k)
    for (const std::string_view below : rooms()[k].may_include)
      EXPECT_TRUE(std::any_of(rooms().begin(), rooms().begin() + static_cast<std::ptrdiff_t>(k),
                              [&](const Room& room) { return room.name == below; }))
          << rooms()[k].name << " may include " << below << ", which does not stand below it";
}

TEST(House, EveryFolderOfSourcesIsADeclaredRoom) {
  const fs::path root = TALUS_SOURCE_DIR;
  for (std::string_view folder : {"kernels", "io", "apps"})
    for (const auto& entry : fs::directory_iterator(root / folder)) {
      const auto has_sources = [](const fs::path& path) {
        return std::any_of(fs::recursive_directory_iterator(path), fs::recursive_directory_iterator(),
                           [](const auto& file) {
                             return file.path().extension() == ".cpp" || file.path().extension() == ".hpp";
                           });
      };
      if (!entry.is_directory() || !has_sources(entry.path())) continue;
      const std::string name = fs::relative(entry.path(), root).generic_string();
      EXPECT_TRUE(std::any_of(rooms().begin(), rooms().end(), [&](const Room& r) { return r.name == name; }))
          << name;
      EXPECT_TRUE(fs::exists(entry.path() / "README.md")) << name << ": a room has a page";
    }
}

TEST(House, TheCheckSeesEveryKindOfForbiddenEdge) {
  EXPECT_NE(fault("io/results/a.cpp", "io/pictures/picture.hpp"), "");
  EXPECT_NE(fault("apps/commands/detail/a.cpp", "apps/study_unknown/a.hpp"), "");
  EXPECT_NE(fault("apps/study_unknown/a.cpp", "apps/shared/median.hpp"), "");
  EXPECT_NE(fault("kernels/bodies/a.hpp", "kernels/detection/chunks.hpp"), "");
  EXPECT_NE(fault("kernels/a.hpp", "io/scene/scene.hpp"), "");
  EXPECT_NE(fault("partition/a.hpp", "runtime/graph/graph.hpp"), "");
  EXPECT_NE(fault("runtime/step/a.cpp", "io/scene/scene.hpp"), "");
  EXPECT_NE(fault("runtime/graph/a.cpp", "kernels/bodies/bodies.hpp"), "");
  EXPECT_NE(fault("runtime/trace/a.cpp", "partition/boxes.hpp"), "");
  EXPECT_NE(fault("runtime/graph/a.cpp", "runtime/step/setup.hpp"), "");
  EXPECT_NE(fault("apps/study_certificate/a.cpp", "kernels/global/admm.hpp"), "");
  EXPECT_NE(fault("apps/study_certificate/a.cpp", "kernels/law/gap_law.hpp"), "");
  EXPECT_NE(fault("kernels/a.cpp", "mpi.h"), "");
  EXPECT_NE(fault("kernels/a.cpp", "fstream"), "");
}

TEST(House, TheCheckLetsDownwardEdgesPass) {
  EXPECT_EQ(fault("io/output/a.cpp", "io/pictures/picture.hpp"), "");
  EXPECT_EQ(fault("io/scene/detail/a.cpp", "io/scene/scene.hpp"), "");
  EXPECT_EQ(fault("io/scene/scene.cpp", "kernels/registry.hpp"), "");
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
