/// Traces whose bits have flipped, or whose lengths are those of another file: they are refused, soon, and
/// without the memory that they ask for.

#include <gtest/gtest.h>
#include <hdf5.h>

#include <chrono>
#include <fstream>
#include <string>

#include "io/files/error.hpp"
#include "io/trace/trace_file.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::io {
namespace {

using talus::test::content_of;

/// "" when it can be read.
std::string refusal_of(const std::filesystem::path& path) {
  try {
    read_trace(path);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

class DamagedTrace : public testing::Test {
 protected:
  DamagedTrace() {
    H5dont_atexit();  // as the command does: files that are damaged cannot always be closed
    write_trace(path_, trace::test::two_subdomains(2));
  }
  const talus::test::ScratchDirectory folder_;
  const std::filesystem::path path_ = folder_ / "trace.h5";
};

TEST_F(DamagedTrace, ThatClaimsMoreRecordsThanItHoldsIsRefused) {
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t records = H5Dopen2(file, "/records/00000000", H5P_DEFAULT), type = H5Dget_type(records);
  const hsize_t claimed = 100'000'000, piece = 1'000;
  const hid_t space = H5Screate_simple(1, &claimed, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(creation, 1, &piece);  // pieces that nobody has written take no room in the file
  const hid_t made = H5Dcreate2(file, "/records/00000999", type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  for (const char* name : {"rank", "thread"}) {
    const hid_t one = H5Screate(H5S_SCALAR);
    H5Aclose(H5Acreate2(made, name, H5T_STD_I64LE, one, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(one);
  }
  for (const hid_t dataset : {records, made}) H5Dclose(dataset);
  H5Tclose(type);
  H5Sclose(space);
  H5Pclose(creation);
  H5Fclose(file);
  ASSERT_LT(std::filesystem::file_size(path_), 200'000U);
  EXPECT_NE(refusal_of(path_).find("more than the file holds"), std::string::npos) << refusal_of(path_);
}

// One bit of every 37th byte. Whatever is read or refused, it is within seconds for all of them.
TEST_F(DamagedTrace, WithAFlippedBitIsReadOrRefusedSoon) {
  const std::string whole = content_of(path_);
  const auto began = std::chrono::steady_clock::now();
  for (std::size_t at = 0; at < whole.size(); at += 37) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (at / 37 % 8)));
    std::ofstream(path_, std::ios::binary) << flipped;
    refusal_of(path_);
    ASSERT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(60)) << "byte " << at;
  }
}

}  // namespace
}  // namespace talus::io
