// The S-EQ1 test piece (an equivalent of the S-shaped piece, not the ISO geometry) from literals.
#pragma once

#include <utility>

#include "model/piece_params.hpp"

namespace vcnc {

inline PieceParams s_eq1() {
  PieceParams piece;
  piece.name = "S-EQ1";
  piece.kind = PieceParams::Kind::ruled;
  piece.degree = 3;
  piece.knots = {0, 0, 0};
  for (int i = 0; i <= 12; ++i) piece.knots.push_back(i / 12.0);
  piece.knots.insert(piece.knots.end(), {1, 1, 1});
  const std::pair<double, double> bottom[] = {
      {60, -60},          {95.267, -48.541}, {117.063, -18.541}, {117.063, 18.541},
      {95.267, 48.541},   {60, 60},          {24.733, 48.541},   {0, 0},
      {-24.733, -48.541}, {-60, -60},        {-95.267, -48.541}, {-117.063, -18.541},
      {-117.063, 18.541}, {-95.267, 48.541}, {-60, 60}};
  const std::pair<double, double> top[] = {
      {61.95, -53.058},   {95.746, -42.395}, {117.029, -14.324},  {118.303, 23.15},
      {95.209, 55.266},   {56, 65.85},       {19.259, 48.358},    {-1.816, -3.564},
      {-24.916, -54.015}, {-64, -65.85},     {-101.681, -50.563}, {-120.775, -15.541},
      {-114.557, 21.933}, {-89.274, 47.097}, {-54.342, 55.53}};
  for (const auto& [x, y] : bottom) piece.bottom.emplace_back(x * 1e-3, y * 1e-3, 0.0);
  for (const auto& [x, y] : top) piece.top.emplace_back(x * 1e-3, y * 1e-3, 40e-3);
  piece.thickness = 3e-3;
  return piece;
}

}  // namespace vcnc
