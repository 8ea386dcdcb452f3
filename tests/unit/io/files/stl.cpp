#include "io/files/stl.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "io/files/error.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::io {
namespace {

class Stl : public testing::Test {
 protected:
  std::string path_ =
      (std::filesystem::temp_directory_path() /
       (std::string("talus_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".stl"))
          .string();

  void write(const std::string& bytes) { std::ofstream(path_, std::ios::binary) << bytes; }
  ~Stl() override { std::filesystem::remove(path_); }
  std::string refusal() {
    try {
      read_stl(path_);
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  }
};

std::string binary(const std::vector<Triangle>& triangles) {
  std::string bytes(84, ' ');
  bytes.replace(0, 5, "solid");  // as some programs begin binary files
  const auto count = static_cast<std::uint32_t>(triangles.size());
  std::memcpy(bytes.data() + 80, &count, 4);
  for (const Triangle& triangle : triangles) {
    float numbers[12] = {};
    for (std::size_t k = 0; k < 9; ++k)
      numbers[3 + k] = static_cast<float>(triangle[k / 3][static_cast<Eigen::Index>(k % 3)]);
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof(numbers)).append(2, '\0');
  }
  return bytes;
}

constexpr const char* one_facet = R"(solid a name of words
facet normal 0 0 1
  outer loop
    vertex 0 0 0.5
    vertex 1e0 +0 0.5
    vertex 0 1 0.5
  endloop
endfacet
endsolid a name of words
)";

TEST_F(Stl, BinaryTrianglesAreThoseWritten) {
  const std::vector<Triangle> triangles = test::box_mesh({0, 0, 0}, {1, 2, 0.5}, 2);
  write(binary(triangles));
  EXPECT_EQ(read_stl(path_), triangles) << "numbers that single precision holds";
}

TEST_F(Stl, TextTrianglesAreThoseWritten) {
  write(one_facet);
  const std::vector<Triangle> expected = {{Vec3(0, 0, 0.5), Vec3(1, 0, 0.5), Vec3(0, 1, 0.5)}};
  EXPECT_EQ(read_stl(path_), expected);
}

TEST_F(Stl, TextOfOtherProgramsIsTheSameText) {
  write(one_facet);
  const std::vector<Triangle> expected = read_stl(path_);
  std::string capitals = one_facet, windows;
  std::ranges::transform(capitals, capitals.begin(), [](unsigned char c) { return std::toupper(c); });
  for (const char c : std::string(one_facet)) windows += c == '\n' ? "\r\n" : std::string(1, c);
  const std::string mark = "\xEF\xBB\xBF";
  for (const std::string& text :
       {capitals, windows, mark + one_facet, mark + windows, "\n  " + std::string(one_facet)}) {
    write(text);
    EXPECT_EQ(refusal(), "") << text;
    EXPECT_EQ(read_stl(path_), expected);
  }
  write(windows.replace(windows.find("1e0"), 3, "one"));
  EXPECT_EQ(refusal(), path_ + ": line 5: expected a finite number, got 'one'");
}

TEST_F(Stl, RefusalsNameFileAndLineOrTriangle) {
  std::string text = one_facet;
  write(text.replace(text.find("1e0"), 3, "nan"));
  EXPECT_EQ(refusal(), path_ + ": line 5: expected a finite number, got 'nan'");
  text = one_facet;
  write(text.replace(text.find("vertex 0 1"), 6, "corner"));
  EXPECT_EQ(refusal(), path_ + ": line 6: expected vertex, got 'corner'");
  write(std::string(one_facet).substr(0, std::string(one_facet).find("vertex 1e0")));
  EXPECT_NE(refusal().find("the end of the file"), std::string::npos) << refusal();
  auto triangles = test::box_mesh({0, 0, 0}, {1, 1, 1});
  triangles[2][1][0] = std::numeric_limits<double>::quiet_NaN();
  write(binary(triangles));
  EXPECT_NE(refusal().find("triangle 3: a coordinate is nan"), std::string::npos) << refusal();
  std::filesystem::remove(path_);
  EXPECT_NE(refusal().find("cannot be opened"), std::string::npos) << refusal();
}

TEST_F(Stl, ANumberOfTrianglesThatTheFileHasNoRoomForIsRefusedBeforeItIsUsed) {
  std::string bytes = binary(test::box_mesh({0, 0, 0}, {1, 1, 1}));
  bytes[0] = 'x';
  const std::uint32_t huge = 0xffffffff;
  std::memcpy(bytes.data() + 80, &huge, 4);
  write(bytes);
  EXPECT_NE(refusal().find("would have 4294967295 triangles"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace talus::io
