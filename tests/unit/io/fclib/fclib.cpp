#include "io/fclib/fclib.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "io/files/error.hpp"
#include "io/results/results.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;

/// What a test writes to a file: FCLIB's datasets, each of which a test may spoil.
struct Contents {
  std::string group = "fclib_local";
  std::vector<int> spacedim = {3}, m = {6}, n = {6}, nz, nzmax, p, i;
  std::vector<double> x, q = {-1, 0, 0, -2, 0.1, 0}, mu = {0.3, 0.5};
};

/// The same 6 x 6 unsymmetric W with incomplete blocks, in the three storages:
/// W = diag(1, 2, 3, 4, 5, 6), W(0, 4) = 7, W(5, 1) = -8.
Contents compressed_rows() {
  Contents c;
  c.nz = {-2}, c.nzmax = {8};
  c.p = {0, 2, 3, 4, 5, 6, 8};
  c.i = {0, 4, 1, 2, 3, 4, 1, 5};
  c.x = {1, 7, 2, 3, 4, 5, -8, 6};
  return c;
}

Contents compressed_columns() {
  Contents c;
  c.nz = {-1}, c.nzmax = {8};
  c.p = {0, 1, 3, 4, 5, 7, 8};
  c.i = {0, 1, 5, 2, 3, 0, 4, 5};
  c.x = {1, 2, -8, 3, 4, 7, 5, 6};
  return c;
}

/// i = rows, p = columns, whatever the comment in fclib.h says; more room (nzmax) than entries.
Contents triplets() {
  Contents c;
  c.nz = {8}, c.nzmax = {20};
  c.i = {5, 0, 1, 2, 3, 4, 5, 0};
  c.p = {1, 0, 1, 2, 3, 4, 5, 4};
  c.x = {-8, 1, 2, 3, 4, 5, 6, 7};
  return c;
}

void write_dataset(hid_t place, const char* name, hid_t type, hid_t memory, std::size_t size,
                   const void* data) {
  const hsize_t extent = size;
  const hid_t space = H5Screate_simple(1, &extent, nullptr);
  const hid_t set = H5Dcreate2(place, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  if (size > 0) H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
  H5Dclose(set);
  H5Sclose(space);
}
void write_dataset(hid_t place, const char* name, const std::vector<int>& values) {
  write_dataset(place, name, H5T_STD_I32LE, H5T_NATIVE_INT, values.size(), values.data());
}
void write_dataset(hid_t place, const char* name, const std::vector<double>& values) {
  write_dataset(place, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values.size(), values.data());
}

class Fclib : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("talus_fclib_" + std::to_string(::getpid()) +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name = "problem.hdf5") const { return folder_ / name; }

  fs::path write(const Contents& c) const {
    const hid_t file = H5Fcreate(path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(file, c.group.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t matrix = H5Gcreate2(group, "W", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t vectors = H5Gcreate2(group, "vectors", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    write_dataset(group, "spacedim", c.spacedim);
    write_dataset(matrix, "m", c.m);
    write_dataset(matrix, "n", c.n);
    write_dataset(matrix, "nz", c.nz);
    write_dataset(matrix, "nzmax", c.nzmax);
    write_dataset(matrix, "p", c.p);
    write_dataset(matrix, "i", c.i);
    write_dataset(matrix, "x", c.x);
    write_dataset(vectors, "q", c.q);
    write_dataset(vectors, "mu", c.mu);
    for (const hid_t id : {vectors, matrix, group}) H5Gclose(id);
    H5Fclose(file);
    return path();
  }

  /// The message with which the file is refused, without a word from HDF5 on the terminal.
  std::string refusal(const fs::path& file) const {
    testing::internal::CaptureStderr();
    std::string message = "accepted";
    try {
      read_fclib(file);
    } catch (const FileError& error) {
      message = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_NE(message.find(file.string()), std::string::npos) << message;
    return message;
  }
  void expect_refused(const Contents& c, const std::string& words) const {
    const std::string message = refusal(write(c));
    EXPECT_NE(message.find(words), std::string::npos) << message << "\nlacks: " << words;
  }

  fs::path folder_;
};

std::vector<double> read_solution(const fs::path& file, const char* name) {
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(id, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(id);
  return values;
}

TEST_F(Fclib, ReadsTheSameProblemFromAllThreeStorages) {
  for (const Contents& c : {compressed_rows(), compressed_columns(), triplets()}) {
    const DelassusProblem p = read_fclib(write(c));
    ASSERT_EQ(p.contacts(), 2U);
    EXPECT_EQ(p.diagonal[0].W, Mat3(Vec3(1, 2, 3).asDiagonal()));
    EXPECT_EQ(p.diagonal[1].W, Mat3(Vec3(4, 5, 6).asDiagonal()));
    ASSERT_EQ(p.block.size(), 2U);
    EXPECT_EQ(p.block[0](0, 1), 7);  // W(0, 4)
    EXPECT_EQ(p.block[0].norm(), 7);
    EXPECT_EQ(p.block[1](2, 1), -8);  // W(5, 1)
    EXPECT_EQ(p.block[1].norm(), 8);
    EXPECT_EQ(p.q[1], Vec3(-2, 0.1, 0));
    EXPECT_EQ(p.diagonal[0].mu, 0.3);
    EXPECT_EQ(p.diagonal[1].mu, 0.5);
  }
}

TEST_F(Fclib, OfOneStemInAFolderHaveNamesOfTheirOwn) {
  const fs::path folder = path("several");
  fs::create_directory(folder);
  for (const char* name : {"a.h5", "a.hdf5", "b.hdf5", "c.txt"}) std::ofstream(folder / name) << "x";
  std::vector<std::string> names;
  for (const FclibFile& file : fclib_files(folder)) names.push_back(file.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a.h5", "a.hdf5", "b"}));
  EXPECT_EQ(fclib_files(folder / "a.h5").at(0).name, "a");
}

TEST_F(Fclib, ProblemsInFoldersBelowAreFoundToo) {
  const fs::path folder = path("deep");
  fs::create_directories(folder / "one/two");
  for (const char* name : {"a.hdf5", "one/a.hdf5", "one/two/b.hdf5"}) std::ofstream(folder / name) << "x";
  std::vector<std::string> names;
  for (const FclibFile& file : fclib_files(folder)) names.push_back(file.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a.hdf5", "one/a.hdf5", "b"}));
}

TEST_F(Fclib, ProblemsInTheFolderOfARunStandBesideItsOtherFiles) {
  const fs::path folder = path("run");
  fs::create_directory(folder);
  fs::copy_file(write(Contents{}), folder / "fclib_000003.hdf5");
  ResultsWriter(folder / "results.h5", {});
  const std::vector<FclibFile> files = fclib_files(folder);
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].name, "fclib_000003");
  fs::remove(folder / "fclib_000003.hdf5");
  EXPECT_THROW(fclib_files(folder), FileError);
}

TEST_F(Fclib, ReadsAProblemWithoutContacts) {
  Contents c;
  c.m = c.n = {0}, c.nz = {-2}, c.nzmax = {0}, c.p = {0};
  c.q.clear(), c.mu.clear();
  EXPECT_EQ(read_fclib(write(c)).contacts(), 0U);
}

TEST_F(Fclib, RefusesFilesThatAreNotThereOrNotHdf5) {
  EXPECT_NE(refusal(path("nowhere.hdf5")).find("does not exist"), std::string::npos);
  EXPECT_NE(refusal(folder_).find("not a file"), std::string::npos);
  std::ofstream(path("text.hdf5")) << "W r + q = u\n";
  EXPECT_NE(refusal(path("text.hdf5")).find("HDF5"), std::string::npos);
  std::ofstream(path("empty.hdf5")).flush();
  EXPECT_NE(refusal(path("empty.hdf5")).find("HDF5"), std::string::npos);
}

TEST_F(Fclib, RefusesATruncatedFileWhereverItIsCut) {
  write(compressed_rows());
  const auto whole = fs::file_size(path());
  for (const auto size : {whole - 1, whole / 2, whole / 8, std::uintmax_t{100}}) {
    fs::copy_file(path(), path("cut.hdf5"), fs::copy_options::overwrite_existing);
    fs::resize_file(path("cut.hdf5"), size);
    EXPECT_NE(refusal(path("cut.hdf5")), "accepted");
  }
}

TEST_F(Fclib, SaysWhichKindsOfProblemItDoesNotSolve) {
  Contents c = compressed_rows();
  c.spacedim = {5};
  expect_refused(c, "spacedim is 5");
  c = compressed_rows();
  c.group = "fclib_global_rolling";
  expect_refused(c, "rolling friction");
  c.group = "results";
  expect_refused(c, "not an FCLIB problem");
}

TEST_F(Fclib, RefusesTheMixedPart) {
  write(compressed_rows());
  const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Gclose(H5Gcreate2(file, "/fclib_local/V", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Fclose(file);
  EXPECT_NE(refusal(path()).find("equality constraints"), std::string::npos);
}

TEST_F(Fclib, NamesTheDatasetThatIsMissingOrOfAnotherKind) {
  write(compressed_rows());
  hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "/fclib_local/vectors/mu", H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_NE(refusal(path()).find("/fclib_local/vectors/mu is missing"), std::string::npos);
  file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t vectors = H5Gopen2(file, "/fclib_local/vectors", H5P_DEFAULT);
  write_dataset(vectors, "mu", std::vector<int>{1, 1});
  H5Gclose(vectors);
  H5Fclose(file);
  EXPECT_NE(refusal(path()).find("does not hold real numbers"), std::string::npos);
}

TEST_F(Fclib, RefusesSizesThatDisagree) {
  Contents c = compressed_rows();
  c.n = {9};
  expect_refused(c, "6 x 9");
  c = compressed_rows();
  c.m = c.n = {7};
  c.p.push_back(8);
  expect_refused(c, "7 x 7");
  c = compressed_rows();
  c.m = c.n = {-6};
  expect_refused(c, "-6 x -6");
  c = compressed_rows();
  c.q.pop_back();
  expect_refused(c, "vectors/q has 5 values instead of 6");
  c = compressed_rows();
  c.mu.push_back(0.1);
  expect_refused(c, "vectors/mu has 3 values instead of 2");
  c = compressed_rows();
  c.spacedim = {3, 3};
  expect_refused(c, "spacedim holds 2 values");
  c = compressed_rows();
  c.p.pop_back();
  expect_refused(c, "W/p has 6 values instead of 7");
  c = compressed_rows();
  c.x.pop_back();
  expect_refused(c, "hold 7 values");
  c = triplets();
  c.nz = {9};
  expect_refused(c, "fewer than nz = 9");
}

TEST_F(Fclib, DoesNotBelieveASizeThatTheFileCannotHold) {
  write(compressed_rows());
  const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "/fclib_local/vectors/q", H5P_DEFAULT);
  const hsize_t terabytes = hsize_t{1} << 40;
  const hid_t space = H5Screate_simple(1, &terabytes, nullptr);
  // Never written, so never allocated: it reads as 8 TB of zeros.
  H5Dclose(H5Dcreate2(file, "/fclib_local/vectors/q", H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT,
                      H5P_DEFAULT));
  H5Sclose(space);
  H5Fclose(file);
  EXPECT_NE(refusal(path()).find("more than the file holds"), std::string::npos);
}

/// Numbers that stand in the header of their dataset, fewer bytes than its shape says: HDF5 would read on.
TEST_F(Fclib, DoesNotBelieveASizeThatTheHeaderCannotHold) {
  const std::string found = TALUS_SOURCE_DIR "/tests/fuzz/corpus/fclib/compact_and_short.hdf5";
  EXPECT_NE(refusal(found).find("vectors/mu claims 14 values, more than the file holds"), std::string::npos)
      << refusal(found);
}

TEST_F(Fclib, RefusesIndicesThatPointOutside) {
  Contents c = compressed_rows();
  c.i[3] = 6;
  expect_refused(c, "W/i[3] is 6");
  c = compressed_rows();
  c.i[0] = -1;
  expect_refused(c, "W/i[0] is -1");
  c = triplets();
  c.p[2] = 100;
  expect_refused(c, "W/p[2] is 100");
  c = compressed_rows();
  c.p[2] = 1;
  expect_refused(c, "less than the 2 before it");
  c = compressed_rows();
  c.p[0] = 1;
  expect_refused(c, "W/p[0] is 1");
  c = compressed_rows();
  c.nz = {-3};
  expect_refused(c, "nz is -3");
}

TEST_F(Fclib, RefusesNumbersThatAreNone) {
  Contents c = compressed_rows();
  c.x[5] = std::numeric_limits<double>::quiet_NaN();
  expect_refused(c, "W/x[5] is nan");
  c = compressed_rows();
  c.q[0] = std::numeric_limits<double>::infinity();
  expect_refused(c, "vectors/q[0] is inf");
  c = compressed_rows();
  c.mu[1] = -0.1;
  expect_refused(c, "vectors/mu[1] is -0.1");
}

TEST_F(Fclib, APlaneProblemIsOneOfSpaceWhoseSecondTangentNothingExcites) {
  Contents c = compressed_rows();
  c.spacedim = {2};
  c.mu = {0.3, 0.4, 0.5};
  const FclibProblem p = read_fclib_problem(write(c));
  ASSERT_EQ(p.contact.contacts(), 3U);
  EXPECT_EQ(p.contact.diagonal[1].W, Mat3(Vec3(3, 4, 3.5).asDiagonal()));  // mean diagonal that of the plane
  const std::vector<double> r = {1, 2, 0, 3, 4, 0, 5, 6, 0};
  const FclibSolution solution = fclib_solution(p, r);
  EXPECT_EQ(solution.r, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  // W(0, 4) = 7 and W(5, 1) = -8 of the plane's rows.
  EXPECT_EQ(solution.u, (std::vector<double>{-1 + 1 + 7 * 5, 4, 9, -2 + 16, 0.1 + 25, 36 - 16}));
}

TEST_F(Fclib, WhatItWritesItReadsBackBitForBit) {
  for (const int dimension : {3, 2}) {
    Contents c = triplets();
    c.spacedim = {dimension};
    if (dimension == 2) c.mu = {0.3, 0.4, 0.5};
    const FclibProblem first = read_fclib_problem(write(c));
    const std::vector<double> r(3 * first.contact.contacts(), 0.25);
    write_fclib(first.contact, fclib_solution(first, r), {"title", "description", "math"},
                path("again.hdf5"));
    const DelassusProblem second = read_fclib(path("again.hdf5"));
    EXPECT_EQ(second.dimension, dimension);
    EXPECT_EQ(second.q, first.contact.q);
    EXPECT_EQ(second.column, first.contact.column);
    EXPECT_EQ(second.block, first.contact.block);
    for (std::size_t k = 0; k < second.contacts(); ++k) {
      EXPECT_EQ(second.diagonal[k].W, first.contact.diagonal[k].W);
      EXPECT_EQ(second.diagonal[k].mu, first.contact.diagonal[k].mu);
    }
    EXPECT_EQ(read_solution(path("again.hdf5"), "/solution/r").size(),
              static_cast<std::size_t>(dimension) * second.contacts());
  }
}

TEST_F(Fclib, WritesTheSolutionIntoACopyAndLeavesTheProblemAlone) {
  write(triplets());
  fs::permissions(path(), fs::perms::owner_read);  // problems are often read-only
  const auto size = fs::file_size(path());
  const std::vector<double> r = {1, 2, 3, 4, 5, 6}, u = {-1, -2, -3, -4, -5, -6};
  write_fclib_solution(path(), path("solved.hdf5"), {r, u, {}, {}});
  write_fclib_solution(path("solved.hdf5"), path("again.hdf5"),
                       {u, r, {}, {}});  // replaces the solution that is there
  EXPECT_EQ(read_solution(path("solved.hdf5"), "/solution/r"), r);
  EXPECT_EQ(read_solution(path("solved.hdf5"), "/solution/u"), u);
  EXPECT_EQ(read_solution(path("again.hdf5"), "/solution/r"), u);
  EXPECT_EQ(read_fclib(path("again.hdf5")).contacts(), 2U);
  EXPECT_EQ(fs::file_size(path()), size);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3) << "a draft was left behind";
}

TEST_F(Fclib, NeverOverwritesTheProblemUnderWhateverName) {
  write(triplets());
  const std::vector<double> r(6, 0.0);
  fs::create_symlink(path(), path("link.hdf5"));
  fs::create_hard_link(path(), path("twin.hdf5"));
  for (const fs::path& out : {path(), folder_ / "." / "problem.hdf5", path("link.hdf5"), path("twin.hdf5")})
    EXPECT_THROW(write_fclib_solution(path(), out, {r, r, {}, {}}), FileError) << out;
  EXPECT_THROW(write_fclib_solution(path(), folder_ / "no" / "folder.hdf5", {r, r, {}, {}}), FileError);
  EXPECT_THROW(write_fclib_solution(path(), folder_, {r, r, {}, {}}), FileError);
}

}  // namespace
}  // namespace talus::io
