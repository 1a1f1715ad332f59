#include "model/geometry/piece.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace vcnc::piece_test {
namespace {

using Kind = PieceParams::Kind;

PieceParams piece_of(Kind kind) {
  PieceParams p;
  p.kind = kind;
  p.centre = Vec3(0.01, -0.02, 0.03);
  p.direction = Vec3(0.1, -0.2, 1).normalized();
  p.radius = 60e-3;
  p.height = 50e-3;
  return p;
}

std::vector<PieceParams> closed_forms() {
  std::vector<PieceParams> pieces;
  for (const Kind kind : {Kind::ring, Kind::sphere, Kind::plane, Kind::cone})
    pieces.push_back(piece_of(kind));
  pieces.push_back(piece_of(Kind::ring));
  pieces.back().bore = false;
  return pieces;
}

double uniform(std::mt19937_64& engine, double half) {
  return half * (2 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1);
}

// What makes a signed distance: 1-Lipschitz, |grad| = 1 along n, zero at the foot.
TEST(Piece, DistanceIsADistance) {
  std::mt19937_64 engine(3);
  for (const PieceParams& params : closed_forms()) {
    const auto piece = make_piece(params);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p(uniform(engine, .12), uniform(engine, .12), uniform(engine, .12));
      const SurfacePoint at = piece->nearest(p, {});
      ASSERT_TRUE(at.valid);
      ASSERT_NEAR(at.n.norm(), 1, 1e-12);
      ASSERT_LT((at.foot + at.distance * at.n - p).norm(), 1e-14);
      ASSERT_NEAR(piece->nearest(at.foot, {}).distance, 0, 1e-14);
      const Vec3 step = Vec3(uniform(engine, 1), uniform(engine, 1), uniform(engine, 1)) * 1e-3;
      ASSERT_LE(std::abs(piece->nearest(p + step, {}).distance - at.distance), step.norm() + 1e-15);
      if (at.distance > 0) {
        // Further out along n the foot stays the same.
        const SurfacePoint further = piece->nearest(p + 1e-3 * at.n, {});
        ASSERT_NEAR(further.distance, at.distance + 1e-3, 1e-13);
      }
    }
  }
}

TEST(Piece, SideOfTheMaterial) {
  PieceParams p = piece_of(Kind::ring);
  EXPECT_NEAR(make_piece(p)->nearest(p.centre, {}).distance, p.radius,
              1e-15);  // free inside a bore
  p.bore = false;
  EXPECT_LT(make_piece(p)->nearest(p.centre, {}).distance, 0);
  p = piece_of(Kind::sphere);
  EXPECT_NEAR(make_piece(p)->nearest(p.centre, {}).distance, -p.radius, 1e-15);
  p = piece_of(Kind::plane);
  EXPECT_NEAR(make_piece(p)->nearest(p.centre + 0.01 * p.direction, {}).distance, 0.01, 1e-15);
  p = piece_of(Kind::cone);
  EXPECT_LT(make_piece(p)->nearest(p.centre + 0.01 * p.direction, {}).distance, 0);
}

TEST(Piece, ScanPathKeepsDistanceAndSpacing) {
  for (PieceParams params : closed_forms()) {
    const auto piece = make_piece(params);
    const double z = params.centre.z() + 0.01, step = 1e-3;
    const auto path = piece->scan_path(3e-3, 0.5e-3, z, step);
    ASSERT_GT(path.size(), 50u);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const SurfacePoint at = piece->nearest(path[i].centre, {});
      ASSERT_NEAR(at.distance, 2.5e-3, 1e-14) << "kind " << static_cast<int>(params.kind);
      ASSERT_LT((at.n - path[i].n).norm(), 1e-10);
      ASSERT_NEAR(path[i].tool_axis.norm(), 1, 1e-12);
      if (i > 0) {
        ASSERT_LE((path[i].centre - path[i - 1].centre).norm(), step + 1e-15);
      }
    }
    if (params.kind != Kind::plane) {
      EXPECT_EQ(path.front().centre, path.back().centre);
    }
  }
}

TEST(Piece, RingOf102_5GivesTheCircleOf100) {
  PieceParams params;
  params.kind = Kind::ring;
  params.radius = 102.5e-3;
  const auto path = make_piece(params)->scan_path(3e-3, 0.5e-3, 0, 1e-3);
  for (const Station& s : path) {
    EXPECT_NEAR(s.centre.norm(), 0.1, 1e-15);
    EXPECT_EQ(s.centre.z(), 0);
    EXPECT_LT((s.n + s.centre.normalized()).norm(), 1e-14);
  }
  EXPECT_LT((path.front().centre - Vec3(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_GT(path[1].centre.y(), 0);  // counter-clockwise
  EXPECT_NEAR(path.back().s, 0.2 * kPi, 1e-15);
}

TEST(Piece, UprightPlaneIsScannedAtItsHeight) {
  PieceParams params;
  params.kind = Kind::plane;
  params.direction = Vec3::UnitX();
  params.radius = 0.1;
  const auto path = make_piece(params)->scan_path(3e-3, 0.5e-3, 0.02, 1e-3);
  EXPECT_LT((path.front().centre - Vec3(2.5e-3, -0.1, 0.02)).norm(), 1e-15);
  EXPECT_LT((path.back().centre - Vec3(2.5e-3, 0.1, 0.02)).norm(), 1e-15);
  EXPECT_LT((path.front().tool_axis - Vec3::UnitZ()).norm(), 1e-15);
}

TEST(Piece, ConeToolFollowsTheFlank) {
  const PieceParams params = piece_of(Kind::cone);
  for (const Station& s :
       make_piece(params)->scan_path(3e-3, 0.5e-3, params.centre.z() + .02, 1e-3)) {
    EXPECT_NEAR(s.tool_axis.dot(s.n), 0, 1e-15);
    EXPECT_NEAR(s.tool_axis.dot(params.direction), std::cos(15 * kDegree), 1e-15);
  }
}

TEST(Piece, RefusesImpossiblePieces) {
  const auto refuses = [](PieceParams p) { EXPECT_THROW(make_piece(p), std::invalid_argument); };
  PieceParams p = piece_of(Kind::cone);
  p.height = 1;
  refuses(p);
  p = piece_of(Kind::ring);
  p.direction = Vec3::Zero();
  refuses(p);
  p = piece_of(Kind::sphere);
  p.radius = -1;
  refuses(p);
  EXPECT_THROW(make_piece(piece_of(Kind::sphere))->scan_path(3e-3, 0, 1, 1e-3),
               std::invalid_argument);
  EXPECT_THROW(make_piece(piece_of(Kind::ring))->scan_path(3e-3, 0, 1, 1e-3),
               std::invalid_argument);
}

TEST(ScanHeight, GivesTheScanPathThroughABallCentre) {
  for (const auto kind :
       {PieceParams::Kind::ring, PieceParams::Kind::sphere, PieceParams::Kind::cone}) {
    PieceParams params;
    params.kind = kind;
    params.direction = Vec3(0.17, 0.05, 0.98).normalized();
    params.height = 0.06;
    params.radius = 0.08;
    const auto piece = make_piece(params);
    const double z = 0.02;
    for (const Station& s : piece->scan_path(3e-3, 0.5e-3, z, 5e-3))
      EXPECT_NEAR(piece->scan_height(s.centre), z, 1e-12);
  }
}

}  // namespace
}  // namespace vcnc::piece_test
