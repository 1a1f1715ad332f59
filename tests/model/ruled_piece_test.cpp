#include "model/geometry/ruled_piece.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "model/geometry/kinematics.hpp"
#include "tests/model/s_eq1.hpp"

namespace vcnc::ruled_piece_test {
namespace {

double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
}

struct GoldenRow {
  double u;
  Vec3 c0, c1, n, d;  // mm, 1
  double a_deg, c_deg;
};
const GoldenRow kGolden[] = {{0.00,
                              {60, -60, 0},
                              {61.95, -53.058, 40},
                              {0.301656, -0.941744, 0.148734},
                              {0.047977, 0.170797, 0.984137},
                              10.21879,
                              164.31001},
                             {0.10,
                              {114.244051, -11.809712, 0},
                              {114.635800, -7.231651, 40},
                              {0.966859, -0.254554, 0.019665},
                              {0.009730, 0.113704, 0.993467},
                              6.55283,
                              175.10906},
                             {0.25,
                              {93.021833, 45.450833, 0},
                              {92.523167, 51.677333, 40},
                              {0.572122, 0.811463, -0.119182},
                              {-0.012317, 0.153799, 0.988025},
                              8.87568,
                              184.57892},
                             {0.40,
                              {32.685301, 47.637912, 0},
                              {27.947323, 48.880939, 40},
                              {-0.620784, 0.777870, -0.097704},
                              {-0.117571, 0.030845, 0.992585},
                              6.98157,
                              255.29953},
                             {0.50,
                              {0, 0, 0},
                              {-2.153500, -3.318833, 40},
                              {-0.905121, 0.424940, -0.013472},
                              {-0.053576, -0.082568, 0.995144},
                              5.64859,
                              327.02157},
                             {0.60,
                              {-32.685301, -47.637912, 0},
                              {-34.094897, -53.050605, 40},
                              {-0.574709, 0.813414, 0.089816},
                              {-0.034900, -0.134014, 0.990365},
                              7.96010,
                              345.40302},
                             {0.75,
                              {-93.021833, -45.450833, 0},
                              {-98.583167, -47.273833, 40},
                              {0.622925, 0.772737, 0.121825},
                              {-0.137569, -0.045095, 0.989465},
                              8.32403,
                              288.14910},
                             {0.90,
                              {-114.244051, 11.809712, 0},
                              {-113.061229, 14.464680, 40},
                              {0.947838, -0.318679, -0.006876},
                              {0.029493, 0.066200, 0.997370},
                              4.15599,
                              155.98643},
                             {1.00,
                              {-60, 60, 0},
                              {-54.342, 55.53, 40},
                              {0.269768, -0.952014, -0.144546},
                              {0.139206, -0.109977, 0.984137},
                              10.21879,
                              51.69014}};

TEST(SEq1, GoldenValues) {
  const RuledPiece piece(s_eq1());
  const RuledSurface& s = piece.surface();
  for (const GoldenRow& row : kGolden) {
    SCOPED_TRACE(row.u);
    EXPECT_LT((s.eval(row.u, 0).s * 1e3 - row.c0).norm(), 1e-6);
    EXPECT_LT((s.eval(row.u, 1).s * 1e3 - row.c1).norm(), 1e-6);
    EXPECT_LT((s.normal(row.u, 0.5) - row.n).norm(), 1e-6);
    EXPECT_LT((s.ruling(row.u) - row.d).norm(), 1e-6);
    const RotaryPair r = rotary_from_axis(s.ruling(row.u), {0.1, row.c_deg * kDegree});
    EXPECT_NEAR(r.a / kDegree, row.a_deg, 1e-5);
    EXPECT_NEAR(r.c / kDegree, row.c_deg, 1e-5);
  }
}

TEST(SEq1, LengthsOfTheCurves) {
  const RuledPiece piece(s_eq1());
  const double expected_mm[] = {527.561, 534.713, 542.730};
  for (int k = 0; k <= 2; ++k) {
    double length = 0;
    Vec3 previous = piece.surface().eval(0, 0.5 * k).s;
    for (int i = 1; i <= 20000; ++i) {
      const Vec3 s = piece.surface().eval(i / 20000.0, 0.5 * k).s;
      length += (s - previous).norm();
      previous = s;
    }
    EXPECT_NEAR(length * 1e3, expected_mm[k], 6e-4);
  }
}

TEST(RuledSurface, DerivativesMatchDifferences) {
  const RuledPiece piece(s_eq1());
  const RuledSurface& s = piece.surface();
  const double h = 1e-6;
  for (int i = 1; i < 40; ++i) {
    const double u = i / 40.0 + 0.003, v = 0.3;
    const auto p = s.eval(u, v), up = s.eval(u + h, v), um = s.eval(u - h, v),
               vp = s.eval(u, v + h);
    EXPECT_LT((p.s_u - (up.s - um.s) / (2 * h)).norm(), 1e-7);
    EXPECT_LT((p.s_uu - (up.s_u - um.s_u) / (2 * h)).norm(), 1e-5);
    EXPECT_LT((p.s_v - (vp.s - p.s) / h).norm(), 1e-8);
    EXPECT_LT((p.s_uv - (vp.s_u - p.s_u) / h).norm(), 1e-7);
  }
}

// A point put at a known distance off a known foot must find that foot again.
TEST(RuledPiece, FindsTheFootOfOffsetPoints) {
  const RuledPiece piece(s_eq1());
  std::mt19937_64 engine(11);
  for (int i = 0; i < 4000; ++i) {
    const double u = uniform(engine, 0.001, 0.999), v = uniform(engine, 0.01, 0.99);
    const double side = i % 2 == 0 ? 1 : -1, reach = uniform(engine, 0.1e-3, 25e-3);
    const Vec3 n = side * piece.surface().normal(u, v), s = piece.surface().eval(u, v).s;
    const SurfacePoint found = piece.nearest(s + reach * n, {});
    ASSERT_TRUE(found.valid);
    ASSERT_NEAR(found.distance, reach - 1.5e-3, 1e-12);
    ASSERT_LT((found.n - n).norm(), 1e-6);
    ASSERT_LT((found.foot - (s + 1.5e-3 * n)).norm(), 1e-9);
    ASSERT_NEAR(found.u, u, 1e-8);
    ASSERT_NEAR(found.v, v, 1e-7);
  }
}

// From anywhere around the rim: no sampled point of the mid-surface is nearer than the answer.
TEST(RuledPiece, ColdStartIsTheGlobalMinimum) {
  const RuledPiece piece(s_eq1());
  std::vector<Vec3> cloud;
  for (int i = 0; i <= 1000; ++i)
    for (int j = 0; j <= 20; ++j) cloud.push_back(piece.surface().eval(i / 1000.0, j / 20.0).s);
  std::mt19937_64 engine(12);
  for (int i = 0; i < 400; ++i) {
    const Vec3 s = piece.surface().eval(uniform(engine, 0, 1), uniform(engine, 0, 1)).s;
    const Vec3 p =
        s +
        Vec3(uniform(engine, -1, 1), uniform(engine, -1, 1), uniform(engine, -1, 1)).normalized() *
            uniform(engine, 1e-3, 30e-3);
    double nearest = 1;
    for (const Vec3& c : cloud) nearest = std::min(nearest, (c - p).norm());
    const SurfacePoint found = piece.nearest(p, {});
    ASSERT_TRUE(found.valid);
    const double to_middle = found.distance + 1.5e-3;
    ASSERT_LE(to_middle, nearest + 1e-12);
    ASSERT_GT(to_middle, nearest - 1.2e-3);  // the cloud is 0.3 mm x 1 mm
    ASSERT_NEAR(found.n.norm(), 1, 1e-12);
    ASSERT_LT((found.foot + found.distance * found.n - p).norm(), 1e-12);
    ASSERT_NEAR((p - piece.surface().eval(found.u, found.v).s).norm(), to_middle, 1e-10);
  }
}

// A walk through the neighbourhood of the piece: the hint never changes the answer.
TEST(RuledPiece, WarmStartAgreesWithColdStart) {
  const RuledPiece piece(s_eq1());
  std::mt19937_64 engine(13);
  SurfacePoint hint;
  Vec3 p(0.06, -0.06, 0.02), v(0, 0, 0);
  for (int i = 0; i < 60000; ++i) {
    v += Vec3(uniform(engine, -1, 1), uniform(engine, -1, 1), uniform(engine, -0.4, 0.4)) * 2e-5;
    v *= 0.998;
    const Vec3 home(0, 0, 0.02);
    v += (home - p) * 3e-6;
    p += v;
    hint = piece.nearest(p, hint);
    ASSERT_TRUE(hint.valid);
    if (i % 7 == 0) {
      ASSERT_NEAR(hint.distance, piece.nearest(p, {}).distance, 1e-11) << p.transpose();
    }
    if (hint.distance < -1.4e-3) hint = {};  // the walk may cross the wall, a ball may not
  }
}

TEST(RuledPiece, SurvivesAWrongHint) {
  const RuledPiece piece(s_eq1());
  std::mt19937_64 engine(14);
  for (int i = 0; i < 2000; ++i) {
    const auto near_rim = [&] {
      const double u = uniform(engine, 0, 1), v = uniform(engine, 0, 1);
      return Vec3(piece.surface().eval(u, v).s + 4e-3 * piece.surface().normal(u, v));
    };
    const SurfacePoint hint = piece.nearest(near_rim(), {});
    const Vec3 p = near_rim();
    ASSERT_NEAR(piece.nearest(p, hint).distance, 2.5e-3, 1e-11);
  }
}

TEST(RuledPiece, EndsAreRound) {
  const RuledPiece piece(s_eq1());
  for (const double u : {0.0, 1.0}) {
    const auto m = piece.surface().eval(u, 0.4);
    const Vec3 d = m.s_v.normalized();
    const Vec3 out = ((u > 0.5 ? 1 : -1) * (m.s_u - d * d.dot(m.s_u))).normalized();
    const SurfacePoint found = piece.nearest(m.s + 5e-3 * out, {});
    EXPECT_EQ(found.u, u);
    EXPECT_NEAR(found.v, 0.4, 1e-9);
    EXPECT_NEAR(found.distance, 3.5e-3, 1e-12);
    EXPECT_LT((found.n - out).norm(), 1e-9);
  }
}

class ScanPath : public testing::TestWithParam<double> {};

TEST_P(ScanPath, KeepsHeightDistanceSpacingAndCloses) {
  const RuledPiece piece(s_eq1());
  const double z = GetParam(), step = 0.5e-3, reach = 3e-3 - 0.5e-3;
  const std::vector<Station> path = piece.scan_path(3e-3, 0.5e-3, z, step);
  ASSERT_GT(path.size(), 2000u);
  EXPECT_LT((path.front().centre - path.back().centre).norm(), 1e-12);
  EXPECT_LT((path.front().n - path.back().n).norm(), 1e-9);
  EXPECT_EQ(path.front().s, 0);
  SurfacePoint hint;
  double longest_turn = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Station& station = path[i];
    ASSERT_NEAR(station.centre.z(), z, 1e-13);
    hint = piece.nearest(station.centre, hint);
    ASSERT_NEAR(hint.distance, reach, 1e-12) << i;
    ASSERT_LT((hint.n - station.n).norm(), 1e-7) << i;
    ASSERT_NEAR(station.tool_axis.norm(), 1, 1e-12);
    ASSERT_NEAR(station.tool_axis.dot(station.n), 0, 1e-9);  // the ruling lies in the face
    if (i == 0) continue;
    const double chord = (station.centre - path[i - 1].centre).norm();
    ASSERT_LE(chord, step);
    ASSERT_GT(chord, 0.9 * step);
    ASSERT_NEAR(station.s - path[i - 1].s, chord, 0.01 * step);
    longest_turn = std::max(longest_turn, (station.n - path[i - 1].n).norm());
  }
  EXPECT_LT(longest_turn, 1.02 * step / (reach + 1.5e-3));  // no jump of the normal at the seams
  // Twice the mid-height line plus two half circles, within the change of length by the offset.
  EXPECT_NEAR(path.back().s, 2 * 0.534 + 2 * kPi * 4e-3, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Heights, ScanPath, testing::Values(5e-3, 20e-3, 35e-3));

// Three conversions from open to closed angle on either face.
TEST(ScanPath, TiltCrossesZeroAtThreeConversions) {
  const RuledPiece piece(s_eq1());
  const std::vector<Station> path = piece.scan_path(3e-3, 0.5e-3, 20e-3, 0.1e-3);
  std::vector<double> plus, minus;
  double largest = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const SurfacePoint at = piece.nearest(path[i].centre, {});
    if (at.u <= 0 || at.u >= 1) continue;
    const bool is_plus = piece.surface().normal(at.u, at.v).dot(path[i].n) > 0;
    largest = std::max(largest, std::abs(path[i].tilt));
    if ((path[i].tilt > 0) != (path[i - 1].tilt > 0)) (is_plus ? plus : minus).push_back(at.u);
    // The wall leans away from the ball where the normal points up (but for the twist of the wall).
    if (std::abs(path[i].tilt) > 8e-3) {
      ASSERT_EQ(path[i].tilt > 0, path[i].n.z() > 0) << at.u;
    }
  }
  ASSERT_EQ(plus.size(), 3u);
  ASSERT_EQ(minus.size(), 3u);
  const double expected[] = {0.1160, 0.5098, 0.8898};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(plus[k], expected[k], 2.5e-4);  // stations are 0.1 mm = 2e-4 in u apart
    EXPECT_NEAR(minus[2 - k], expected[k], 2.5e-4);
  }
  EXPECT_NEAR(largest / kDegree, 8.489, 1e-3);
}

TEST(ScanPath, RefusesWhatIsNotOnTheFaces) {
  const RuledPiece piece(s_eq1());
  EXPECT_THROW(piece.scan_path(3e-3, 0.5e-3, 41e-3, 1e-3), std::invalid_argument);
  EXPECT_THROW(piece.scan_path(3e-3, 0.5e-3, -1e-3, 1e-3), std::invalid_argument);
  EXPECT_THROW(piece.scan_path(3e-3, 5e-3, 20e-3, 1e-3), std::invalid_argument);
  EXPECT_THROW(piece.scan_path(3e-3, 0.5e-3, 20e-3, 0), std::invalid_argument);
}

TEST(MakePiece, NamesTheKeyOfABadRim) {
  PieceParams bad = s_eq1();
  bad.top.pop_back();
  try {
    make_piece(bad);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind("top_mm: ", 0), 0u) << error.what();
  }
  bad = s_eq1();
  bad.thickness = 0;
  EXPECT_THROW(make_piece(bad), std::invalid_argument);
  bad = s_eq1();
  bad.top = bad.bottom;
  EXPECT_THROW(make_piece(bad), std::invalid_argument);
}

}  // namespace
}  // namespace vcnc::ruled_piece_test
