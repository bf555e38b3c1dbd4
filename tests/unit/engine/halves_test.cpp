// SPDX-License-Identifier: Apache-2.0
// Halves do in two registers what the compiler's vectors do in one, bit for bit.
#include "engine/simd/halves.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

// An alias of a dependent type drops the attribute.
struct OfFloats {
  using Element = float;
  using Whole = float __attribute__((vector_size(32)));
  using Half = float __attribute__((vector_size(16)));
};
struct OfDoubles {
  using Element = double;
  using Whole = double __attribute__((vector_size(32)));
  using Half = double __attribute__((vector_size(16)));
};
struct OfInts {
  using Element = std::int32_t;
  using Whole = std::int32_t __attribute__((vector_size(32)));
  using Half = std::int32_t __attribute__((vector_size(16)));
};
struct OfShorts {
  using Element = std::int16_t;
  using Whole = std::int16_t __attribute__((vector_size(32)));
  using Half = std::int16_t __attribute__((vector_size(16)));
};

template <class Vectors>
class HalvesTest : public ::testing::Test {
 protected:
  using Element = typename Vectors::Element;
  using Whole = typename Vectors::Whole;
  using Pair = Halves<typename Vectors::Half>;
  static constexpr std::size_t kLanes = 32 / sizeof(Element);
  using Values = std::array<Element, kLanes>;

  Values draw() {
    Values values;
    for (Element& value : values) {
      if constexpr (std::is_integral_v<Element>) {
        value = static_cast<Element>(random_());
      } else {
        using Limits = std::numeric_limits<Element>;
        constexpr std::array kSpecial{Element{0},          -Element{0},           Limits::infinity(),
                                      -Limits::infinity(), Limits::quiet_NaN(),   Limits::denorm_min(),
                                      Limits::max(),       -Limits::denorm_min(), Element{1}};
        const auto which = random_() % (2 * kSpecial.size());
        value = which < kSpecial.size() ? kSpecial[which] : static_cast<Element>(normal_(random_));
      }
    }
    return values;
  }
  template <class To>
  static To as(const Values& values) {
    To to;
    static_assert(sizeof to == sizeof values);
    std::memcpy(&to, values.data(), sizeof to);
    return to;
  }
  template <class A, class B>
  static void expect_same(const A& whole, const B& halves, const char* what) {
    static_assert(sizeof(A) == 32 && sizeof(B) == 32);
    EXPECT_EQ(std::memcmp(&whole, &halves, 32), 0) << what;
  }

  std::mt19937 random_{7};
  std::normal_distribution<double> normal_{0, 1000};
};

using OfAll = ::testing::Types<OfFloats, OfDoubles, OfInts, OfShorts>;
TYPED_TEST_SUITE(HalvesTest, OfAll);

TYPED_TEST(HalvesTest, EachOperationIsThatOfTheCompilersVectors) {
  using Whole = typename TestFixture::Whole;
  using Pair = typename TestFixture::Pair;
  using Element = typename TestFixture::Element;
  constexpr bool kIntegral = std::is_integral_v<Element>;
  for (int round = 0; round < 2000; ++round) {
    const auto x = this->draw();
    const auto y = this->draw();
    const Element s = this->draw()[0];
    const auto a = this->template as<Whole>(x), b = this->template as<Whole>(y);
    const auto c = this->template as<Pair>(x), d = this->template as<Pair>(y);
    // Sums and products of NaN may have the bits of either.
    if constexpr (kIntegral) {
      // Of half as many bits, so that no product overflows.
      constexpr Element kAway = 4 * sizeof(Element) + 1;
      const Whole e = a >> kAway, f = b >> kAway;
      const Pair g = c >> kAway, h = d >> kAway;
      const auto t = static_cast<Element>(s >> kAway);
      this->expect_same(e + f, g + h, "+");
      this->expect_same(e - f, g - h, "-");
      this->expect_same(e * f, g * h, "*");
      this->expect_same(e + t, g + t, "+ number");
      this->expect_same(t - e, t - g, "number -");
      this->expect_same(-e, -g, "negated");
      this->expect_same(a & b, c & d, "&");
      this->expect_same(a | b, c | d, "|");
      this->expect_same(a ^ b, c ^ d, "^");
      this->expect_same(~a, ~c, "~");
      this->expect_same(a >> Element{3}, c >> Element{3}, ">>");
      this->expect_same(a << Element{3}, c << Element{3}, "<<");
    } else {
      const auto is_number = [](auto v) { return v == v; };
      this->expect_same(is_number(a + b), is_number(c + d), "+, numbers");
      this->expect_same(is_number(a + b) ? a + b : Whole{}, select(is_number(c + d), c + d, Pair{}), "+");
      this->expect_same(is_number(a - b) ? a - b : Whole{}, select(is_number(c - d), c - d, Pair{}), "-");
      this->expect_same(is_number(a * s) ? a * s : Whole{}, select(is_number(c * s), c * s, Pair{}), "*");
      this->expect_same(is_number(s / a) ? s / a : Whole{}, select(is_number(s / c), s / c, Pair{}), "/");
      this->expect_same(is_number(a) ? -a : Whole{}, select(is_number(c), -c, Pair{}), "negated");
    }
    this->expect_same(a < b, c < d, "<");
    this->expect_same(a <= b, c <= d, "<=");
    this->expect_same(a > s, c > s, "> number");
    this->expect_same(s >= a, s >= c, "number >=");
    this->expect_same(a == b, c == d, "==");
    this->expect_same(a != b, c != d, "!=");
    this->expect_same(a < b ? a : b, lesser(c, d), "lesser");
    this->expect_same(a > b ? a : b, greater(c, d), "greater");
    this->expect_same(a < b ? b : a, select(c < d, d, c), "select");
    for (std::size_t lane = 0; lane < TestFixture::kLanes; ++lane)
      EXPECT_EQ(std::memcmp(&x[lane], std::array{c[static_cast<int>(lane)]}.data(), sizeof s), 0);
  }
}

TEST(HalvesShuffles, TakeLanesOfTwoHalves) {
  const Halves<Float4> a{0.0F, 1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F};
  const Halves<Float4> b{8.0F, 9.0F, 10.0F, 11.0F, 12.0F, 13.0F, 14.0F, 15.0F};
  const auto expect = [](const Halves<Float4>& got, const std::array<int, 8>& lanes) {
    for (int i = 0; i < 8; ++i) EXPECT_EQ(got[i], static_cast<float>(lanes[static_cast<std::size_t>(i)]));
  };
  expect(shuffle<0, 8, 1, 9, 4, 12, 5, 13>(a, b), {0, 8, 1, 9, 4, 12, 5, 13});
  expect(shuffle<2, 3, 10, 11, 6, 7, 14, 15>(a, b), {2, 3, 10, 11, 6, 7, 14, 15});
  expect(shuffle<0, 1, 2, 3, 8, 9, 10, 11>(a, b), {0, 1, 2, 3, 8, 9, 10, 11});
  expect(shuffle<4, 5, 6, 7, 12, 13, 14, 15>(a, b), {4, 5, 6, 7, 12, 13, 14, 15});
  expect(shuffle<4, 5, 6, 7, 0, 1, 2, 3>(a, a), {4, 5, 6, 7, 0, 1, 2, 3});
  expect(shuffle<3, 3, 3, 0, 1, 2, 4, 5>(a, a), {3, 3, 3, 0, 1, 2, 4, 5});
  expect(shuffle<6, 4, 5, 6, 4, 5, 6, 7>(b, a), {14, 12, 13, 14, 12, 13, 14, 15});
}

TEST(HalvesOfFewerLanes, WhatIsLeftOutIsNothing) {
  const Halves<Float4> two{1.0F, 2.0F};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(two[i], i < 2 ? static_cast<float>(i + 1) : 0.0F);
  const Halves<Float4> none{};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(none[i], 0.0F);
}

}  // namespace
}  // namespace warmfront
