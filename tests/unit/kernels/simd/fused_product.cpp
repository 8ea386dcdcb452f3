/// The fused product of processors without an instruction for it, against that of the C library.

#include "kernels/simd/fused_product.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "kernels/simd/lanes.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;

template <class Number>
bool same(Number a, Number b) {
  return (std::isnan(a) && std::isnan(b)) || (a == b && std::signbit(a) == std::signbit(b));
}

/// Any bits; or numbers near 1, some of them short, so that sums cancel; or zeros.
double any_double(Random& random) {
  const auto kind = random() % 8;
  if (kind < 2) return std::bit_cast<double>(static_cast<std::uint64_t>(random()));
  if (kind == 2) return random() % 2 == 0 ? 0.0 : -0.0;
  const double x =
      std::ldexp(static_cast<double>(random() >> 11) - 0x1p52, static_cast<int>(random() % 9) - 57);
  return kind == 3 ? std::round(64 * x) / 64 : x;
}

TEST(FusedProduct, OfDoublesIsTheOneOfTheCLibrary) {
  Random random(1);
  for (int k = 0; k < 200000; ++k) {
    Quad a, b, c;
    for (int l = 0; l < 4; ++l) {
      a[l] = any_double(random);
      b[l] = any_double(random);
      // Every third sum cancels, wholly or down to what the product was rounded by.
      c[l] = random() % 3 == 0 ? -a[l] * b[l] : any_double(random);
    }
    const Quad found = fused_doubles<QuadOfBits>(a, b, c);
    for (int l = 0; l < 4; ++l)
      ASSERT_TRUE(same(found[l], std::fma(a[l], b[l], c[l]))) << a[l] << " " << b[l] << " " << c[l];
  }
}

TEST(FusedProduct, OfFloatsIsTheOneOfTheCLibrary) {
  Random random(2);
  for (int k = 0; k < 200000; ++k) {
    NarrowOctet a, b, c;
    for (int l = 0; l < 8; ++l) {
      const auto bits = random();
      const bool any = bits % 4 == 0;
      a[l] = any ? std::bit_cast<float>(static_cast<std::uint32_t>(random())) : float(any_double(random));
      b[l] = float(any_double(random));
      c[l] = bits % 3 == 0 ? -a[l] * b[l] : float(any_double(random));
    }
    const NarrowOctet found = fused_floats<OctetOfBits, Octet>(a, b, c);
    for (int l = 0; l < 8; ++l)
      ASSERT_TRUE(same(found[l], std::fma(a[l], b[l], c[l]))) << a[l] << " " << b[l] << " " << c[l];
  }
}

}  // namespace
}  // namespace talus
