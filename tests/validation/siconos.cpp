/// A contact problem dumped from a run, read and solved by Siconos (siconos/nsgs.cpp).

#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "io/fclib/fclib.hpp"
#include "kernels/delassus/delassus_solve.hpp"

namespace talus::siconos_test {
namespace {

namespace fs = std::filesystem;

#ifdef TALUS_SICONOS_NSGS
constexpr const char* siconos = TALUS_SICONOS_NSGS;
#else
constexpr const char* siconos = "";
#endif

/// /solution/r.
std::vector<double> solution_of(const fs::path& path) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, "/solution/r", H5P_DEFAULT), space = H5Dget_space(set);
  std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
  return values;
}

class Dump : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("talus_dump_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs a small scene and returns the dump of a step.
  fs::path dump() const {
    const std::string command =
        std::string(TALUS_COMMAND) +
        " run " TALUS_SOURCE_DIR
        "/apps/scenes/demo.toml --threads 1 --steps 12 --dump-fclib 12 --set "
        "sample.count=60 --set solver.tolerance=1e-6 --set solver.max_iterations=50000 "
        "--set allow_unconverged=true --out " +
        (folder_ / "run").string() + " > " + (folder_ / "log").string() + " 2>&1";
    if (std::system(command.c_str()) != 0) {
      std::ifstream log(folder_ / "log");
      ADD_FAILURE() << command << '\n' << std::string(std::istreambuf_iterator<char>(log), {});
    }
    return folder_ / "run" / "fclib_000012.hdf5";
  }

  fs::path folder_;
};

TEST_F(Dump, HoldsTheProblemThatTheStepSolved) {
  const fs::path file = dump();
  ASSERT_TRUE(fs::exists(file));
  const DelassusProblem p = io::read_fclib(file);
  ASSERT_GT(p.contacts(), 60U);
  std::vector<double> r(3 * p.contacts(), 0.0), u(r.size());
  const auto report = solve_delassus(p, DelassusMethod::automatic, {.tolerance = 1e-8}, r);
  EXPECT_TRUE(report.converged) << report.error.siconos << ' ' << report.error.scaled;
  // The impulses that the sweeps of the step ended with, which know no W, solve u = W r + q to their
  // tolerance.
  const std::vector<double> found = solution_of(file);
  ASSERT_EQ(found.size(), r.size());
  EXPECT_GT(*std::max_element(found.begin(), found.end()), 0);
  EXPECT_LE(delassus_error(p, found, u).scaled, 1e-4);
}

TEST_F(Dump, SiconosReadsItAndFindsTheSameVelocities) {
  if (std::string(siconos).empty())
    GTEST_SKIP() << "libsiconos-numerics-dev or libfclib-dev is not installed";
  const fs::path file = dump();
  const DelassusProblem p = io::read_fclib(file);
  std::vector<double> r(3 * p.contacts(), 0.0), u(r.size());
  ASSERT_TRUE(solve_delassus(p, DelassusMethod::automatic, {.tolerance = 1e-8}, r).converged);
  const double own = delassus_error(p, r, u).siconos;
  const fs::path solved = folder_ / "solved.hdf5";
  io::write_fclib_solution(file, solved, io::fclib_solution({p, {}}, r));

  std::FILE* pipe = ::popen((std::string(siconos) + ' ' + solved.string() + " 1e-8").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  int info = -1;
  double error = 1, given = 1;
  ASSERT_EQ(std::fscanf(pipe, "%d %lf given %lf", &info, &error, &given), 3);
  std::vector<double> theirs;
  for (double value = 0; std::fscanf(pipe, "%lf", &value) == 1;) theirs.push_back(value);
  ASSERT_EQ(::pclose(pipe), 0);
  EXPECT_EQ(info, 0) << "NSGS did not converge: " << error;
  // Our answer, judged by fc3d_compute_error: the same number as ours, but for rounding.
  EXPECT_NEAR(given, own, 1e-3 * own + 1e-15);
  ASSERT_EQ(theirs.size(), u.size());
  double largest = 0, difference = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    largest = std::max(largest, std::abs(u[k]));
    difference = std::max(difference, std::abs(u[k] - theirs[k]));
  }
  EXPECT_LE(difference, 1e-5 * largest);
}

}  // namespace
}  // namespace talus::siconos_test
