#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/shared/solve_table.hpp"

namespace talus {

/// One solve of one FCLIB problem to a tolerance; times are elapsed ones, medians of the repetitions [s].
struct ProfileRow {
  double tolerance = 0;
  SolveRow solve;
};

/// Names of the methods for problems given by W.
std::vector<std::string> profile_methods();

/// Throws io::FileError when the folder holds no FCLIB file, std::invalid_argument when a method is not
/// known.
void check_profile(const std::filesystem::path& folder, std::span<const std::string> methods);

/// How FCLIB problems are solved for a performance profile.
struct ProfilePlan {
  std::vector<std::string> methods;  ///< of profile_methods()
  std::vector<double> tolerances;
  double max_seconds = 60;  ///< of one solve
};

/// Solves every FCLIB file of the folder (io::fclib_files) with every method and tolerance of the plan, and
/// appends the rows; `keep` is called behind each file. A file that cannot be read is
/// said and left out. Throws io::FileError when none can, std::invalid_argument when a method is not known.
void study_profile(const std::filesystem::path& folder, const ProfilePlan& plan,
                   const std::function<void(const std::string&)>& say, const std::function<void()>& keep,
                   std::vector<ProfileRow>& rows);

}  // namespace talus
