#include <gtest/gtest.h>

#include <sstream>

#include "io/output/recorder.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

using namespace talus::test;

TEST(XyzSink, WritesEveryGrainOfEveryFrameInFullPrecision) {
  const ScratchDirectory scratch;
  Recorder recorder(output_context(scratch.path(), setup_with_two_walls()), {"xyz"});
  recorder.open();
  recorder.record_frame(three_grains());
  recorder.record_frame(three_grains());
  recorder.close();
  std::istringstream file(content_of(scratch / "frames.xyz"));
  const Frame frame = three_grains();
  for (int k = 0; k < 2; ++k) {
    std::string count, columns;
    std::getline(file, count);
    std::getline(file, columns);
    EXPECT_EQ(count, "3");
    EXPECT_NE(columns.find("Properties=id:I:1:pos:R:3:radius:R:1:velo:R:3 "), std::string::npos) << columns;
    for (std::size_t grain = 0; grain < 3; ++grain) {
      std::string line;
      std::getline(file, line);
      std::istringstream numbers(line);
      std::int64_t id = -1;
      double x = 0, y = 0, z = 0, radius = 0, u = 0, v = 0, w = 0;
      numbers >> id >> x >> y >> z >> radius >> u >> v >> w;
      ASSERT_TRUE(numbers) << line;
      EXPECT_EQ(id, frame.id[grain]);
      EXPECT_EQ(Vec3(x, y, z), frame.x[grain]);
      EXPECT_EQ(radius, frame.radius[grain]);
      EXPECT_EQ(Vec3(u, v, w), frame.u[grain]);
    }
  }
  std::string more;
  EXPECT_FALSE(std::getline(file, more)) << more;
}

TEST(XyzSink, IsWrittenOnRequestOnly) {
  const ScratchDirectory scratch;
  Recorder recorder(output_context(scratch.path(), setup_with_two_walls()), {});
  recorder.open();
  EXPECT_FALSE(std::filesystem::exists(scratch / "frames.xyz"));
}

}  // namespace
}  // namespace talus::io
