// The sample in space, and images as PNG.

#include "io/pictures/view.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

#include "io/results/wall_triangles.hpp"

namespace talus::io::view_test {
namespace {

Frame grains(const std::vector<Vec3>& places) {
  Frame frame;
  for (std::size_t k = 0; k < places.size(); ++k) {
    frame.id.push_back(static_cast<std::int64_t>(k));
    frame.x.push_back(places[k]);
    frame.radius.push_back(0.1);
    frame.u.push_back(Vec3::Zero());
    frame.material.push_back(static_cast<std::int64_t>(k));
  }
  return frame;
}

std::array<int, 3> pixel(const Image& image, std::size_t x, std::size_t y) {
  const std::size_t at = 3 * (y * image.width + x);
  return {image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]};
}

/// From the front, with y away from the viewer.
ViewOptions from_front() {
  ViewOptions options;
  options.camera = {-90, 0};
  options.width = 200;
  options.colour = GrainColour::material;
  return options;
}

bool is_blue(const std::array<int, 3>& c) {  // the first material's
  return c[2] > 1.3 * c[0] && c[2] > 1.1 * c[1];
}
bool is_orange(const std::array<int, 3>& c) {  // the second one's
  return c[0] > 1.5 * c[1] && c[0] > 2 * c[2];
}

TEST(View, TheNearerGrainHidesTheOther) {
  const Image hidden = render_view(grains({{0, -1, 0}, {0, 1, 0}}), {}, {}, from_front());
  EXPECT_TRUE(is_blue(pixel(hidden, hidden.width / 2, hidden.height / 2)));
  const Image other = render_view(grains({{0, 1, 0}, {0, -1, 0}}), {}, {}, from_front());
  EXPECT_TRUE(is_orange(pixel(other, other.width / 2, other.height / 2)));
}

TEST(View, RightIsXAndUpIsZFromTheFront) {
  const Image image = render_view(grains({{0, 0, 0}, {1, 0, 0.5}}), {}, {}, from_front());
  // The box is 1.2 wide in 92 % of 200 px, and 0.7 high.
  const auto at = [&](double x, double z) {
    const double scale = 0.92 * 200 / 1.2;
    return pixel(image, static_cast<std::size_t>(100 + (x - 0.5) * scale),
                 static_cast<std::size_t>(static_cast<double>(image.height) / 2 - (z - 0.25) * scale));
  };
  EXPECT_TRUE(is_blue(at(0, 0)));
  EXPECT_TRUE(is_orange(at(1, 0.5)));
  EXPECT_EQ(at(1, 0), (std::array<int, 3>{255, 255, 255}));
}

TEST(View, AWallBeforeTheGrainsHidesNothing) {
  const Frame frame = grains({{0, 0, 0}});
  std::vector<Wall> walls(2);
  std::vector<WallReport> now(2);
  now[0].normal = walls[0].normal = Vec3::UnitY();  // before
  now[1].normal = walls[1].normal = -Vec3::UnitY();
  now[0].position = now[1].position = -0.2;
  const auto triangles = wall_triangles(walls, now, {Vec3::Constant(-0.2), Vec3::Constant(0.2)});
  const Image image = render_view(frame, walls, triangles, from_front());
  EXPECT_TRUE(is_blue(pixel(image, image.width / 2, image.height / 2)));
  EXPECT_NE(pixel(image, image.width / 2, image.height / 10), (std::array<int, 3>{255, 255, 255}))
      << "the one behind is seen beside the grain";
}

TEST(View, OfNothingIsAWhiteImage) {
  const Image image = render_view({}, {}, {}, {});
  EXPECT_EQ(image.rgb.size(), 3 * image.width * image.height);
  EXPECT_EQ(pixel(image, 0, 0), (std::array<int, 3>{255, 255, 255}));
}

TEST(View, OfWhatNoPictureHoldsIsAWhiteImage) {
  for (const double far : {1e120, 1e300}) {
    const Image image = render_view(grains({{0, 0, 0}, {far, 0, 0}}), {}, {}, {});
    ASSERT_GT(image.width * image.height, 0U);
    EXPECT_EQ(image.rgb, std::vector<std::uint8_t>(3 * image.width * image.height, 255)) << far;
  }
  const Image flat = render_view(grains({{0, 0, 0}, {1e14, 0, 0}}), {}, {}, from_front());
  EXPECT_EQ(flat.rgb.size(), 3 * flat.width * flat.height);
  EXPECT_GT(flat.height, 0U);
}

TEST(View, ColoursAreBySpeedRadiusForceOrMaterial) {
  Frame frame = grains({{0, 0, 0}, {1, 0, 0}});
  frame.u[1] = {0, 3, 4};
  frame.contact_bodies = {{0, 1}, {1, -1}};
  frame.contact_normal = {Vec3(-1, 0, 0), Vec3(0, 0, 1)};
  frame.contact_force = {Vec3(-2, 9, 0), Vec3(0, 0, 5)};
  EXPECT_EQ(grain_values(frame, grain_colours().named("speed").kind), (std::vector<double>{0, 5}));
  EXPECT_EQ(grain_values(frame, grain_colours().named("force").kind), (std::vector<double>{2, 7}));
  EXPECT_EQ(grain_values(frame, grain_colours().named("radius").kind), (std::vector<double>{0.1, 0.1}));
  EXPECT_EQ(grain_values(frame, grain_colours().named("material").kind), (std::vector<double>{0, 1}));
  EXPECT_THROW(grain_colours().named("taste"), std::invalid_argument);
}

TEST(View, AComponentOfTheVelocityHasOneColourForEachWayAndNoneAtRest) {
  Frame frame = grains({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  frame.u[0] = {7, -2, 0};
  frame.u[2] = {7, 1, 0};
  const GrainColour along_y = grain_colours().named("velocity_y").kind;
  const std::vector<double> values = grain_values(frame, along_y);
  EXPECT_EQ(values, (std::vector<double>{-2, 0, 1}));
  EXPECT_EQ(grain_values(frame, GrainColour::velocity_x), (std::vector<double>{7, 0, 7}));
  EXPECT_EQ(grain_values(frame, GrainColour::velocity_z), (std::vector<double>{0, 0, 0}));
  const ColourRange range = colour_range(values, along_y);
  EXPECT_EQ(range.low, -range.high);
  EXPECT_GT(range.high, 0);
  const auto back = colour_of(-1, range, along_y), ahead = colour_of(1, range, along_y),
             rest = colour_of(0, range, along_y);
  EXPECT_GT(back[2], back[0] + 0.2) << "blue";
  EXPECT_GT(ahead[0], ahead[2] + 0.2) << "red";
  EXPECT_NEAR(rest[0], rest[2], 0.01) << "grey";
  EXPECT_EQ(colour_range(std::vector<double>(3, 0.0), along_y).low, -1) << "at rest there is a scale, too";
}

TEST(View, ASliceShowsOnlyGrainsAboutTheMiddleOfItsAxis) {
  // Four mean radii are 0.4: of five grains along y the ones at -0.15, 0 and 0.15 are in it.
  const Frame frame = grains({{0, -0.25, 0}, {1, -0.15, 0}, {2, 0, 0}, {3, 0.15, 0}, {4, 0.25, 0}});
  ViewOptions options = from_front();
  const auto is_there = [&](const Image& image, double x) {
    const double scale = 0.92 * 200 / 4.2;
    return pixel(image, static_cast<std::size_t>(100 + (x - 2) * scale), image.height / 2) !=
           std::array<int, 3>{255, 255, 255};
  };
  const Image whole = render_view(frame, {}, {}, options);
  options.slice = 1;
  const Image slice = render_view(frame, {}, {}, options);
  for (const double x : {0, 1, 2, 3, 4}) {
    EXPECT_TRUE(is_there(whole, x)) << x;
    EXPECT_EQ(is_there(slice, x), x > 0 && x < 4) << x;
  }
  EXPECT_NE(draw_view(frame, {}, options).find("a slice across y shown"), std::string::npos);
  EXPECT_EQ(draw_view(grains({}), {}, options).find("nan"), std::string::npos);
}

TEST(View, TheScaleOfAFewThatMoveAmongGrainsAtRestIsTheirs) {
  std::vector<double> speeds(100, 0.0);
  EXPECT_EQ(colour_range(speeds, GrainColour::speed).high, 1);
  speeds[7] = 0.02;
  EXPECT_EQ(colour_range(speeds, GrainColour::speed).high, 0.02);
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t k = 0; k < 4; ++k) number = number << 8 | static_cast<unsigned char>(bytes[at + k]);
  return number;
}

TEST(Png, HoldsThePixelsThatItWasGiven) {
  Image image{5, 3, {}};
  for (int k = 0; k < 45; ++k) image.rgb.push_back(static_cast<std::uint8_t>(37 * k * k));
  const std::string file = png_bytes(image);
  EXPECT_EQ(file.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(file.substr(12, 4), "IHDR");
  EXPECT_EQ(number_at(file, 16), 5u);
  EXPECT_EQ(number_at(file, 20), 3u);
  constexpr std::size_t data = 8 + 25;
  EXPECT_EQ(file.substr(data + 4, 4), "IDAT");
  const std::uint32_t length = number_at(file, data);
  std::vector<unsigned char> rows(3 * (1 + 15));
  uLongf size = rows.size();
  ASSERT_EQ(uncompress(rows.data(), &size, reinterpret_cast<const Bytef*>(file.data() + data + 8), length),
            Z_OK);
  for (std::size_t y = 0; y < 3; ++y)
    for (std::size_t k = 0; k < 15; ++k) {
      unsigned char* row = rows.data() + 16 * y + 1;
      ASSERT_EQ(rows[16 * y], 1);
      if (k >= 3) row[k] = static_cast<unsigned char>(row[k] + row[k - 3]);
      EXPECT_EQ(row[k], image.rgb[15 * y + k]);
    }
  image.rgb.pop_back();
  EXPECT_THROW(png_bytes(image), std::invalid_argument);
}

}  // namespace
}  // namespace talus::io::view_test
