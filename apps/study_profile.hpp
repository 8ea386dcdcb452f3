#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace talus {

/// One solve of one FCLIB problem.
struct ProfileRow {
  std::string problem, method;
  double tolerance = 0;
  std::int64_t contacts = 0, iterations = 0;
  double seconds = 0;                  ///< of the solve, median of the repetitions [s]
  double error = 0, scaled_error = 0;  ///< kernels/delassus.hpp
  bool solved = false;
};

/// Names of the methods for problems given by W.
std::vector<std::string> profile_methods();

/// Throws io::FileError when the folder holds no FCLIB file, std::invalid_argument when a method is not
/// known.
void check_profile(const std::filesystem::path& folder, std::span<const std::string> methods);

/// Solves every FCLIB file of the folder (io::fclib_files) with every method and tolerance, in at most
/// `max_seconds` each. A file that cannot be read is said and left out. Throws io::FileError when none can,
/// std::invalid_argument when a method is not known.
std::vector<ProfileRow> study_profile(const std::filesystem::path& folder,
                                      std::span<const std::string> methods,
                                      std::span<const double> tolerances, double max_seconds,
                                      const std::function<void(const std::string&)>& say);

/// Performance profile (Dolan and More 2002) of a method at a tolerance: points (ratio, part of the problems
/// that it solved in at most ratio times the time of the fastest method at this tolerance), ratios ascending,
/// each once. Problems that no method solved count as well.
std::vector<std::array<double, 2>> performance_profile(std::span<const ProfileRow> rows,
                                                       const std::string& method, double tolerance);

}  // namespace talus
