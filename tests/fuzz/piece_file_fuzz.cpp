// A piece file: parsing, the geometry behind it, its nearest points and its scan path.
#include <cmath>
#include <stdexcept>

#include "configs/config.hpp"
#include "fuzz.hpp"
#include "model/geometry/piece.hpp"

namespace {

using namespace vcnc;

void use(const Piece& piece) {
  SurfacePoint hint;
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(0.01, 0.02, 0.03), Vec3(0.0101, 0.0201, 0.0301),
                        Vec3(-0.3, 0.1, 0.5)}) {
    hint = piece.nearest(p, hint);
    if (hint.valid) fuzz::require(std::isfinite(hint.distance) && hint.n.allFinite());
  }
  const double z = piece.scan_height(piece.params().centre);
  const double step = std::max(1e-2, 1e-3 * piece.params().radius);
  for (const double height : {z, z + 0.02}) try {
      for (const Station& station : piece.scan_path(3e-3, 0.5e-3, height, step))
        fuzz::require(std::isfinite(station.s) && station.centre.allFinite() &&
                      station.n.allFinite() && station.tool_axis.allFinite() &&
                      std::isfinite(station.tilt));
    } catch (const std::invalid_argument&) {
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const PieceParams params = parse_piece(fuzz::text_of(data, size), "input.toml");
    const std::string written = to_toml(params);
    fuzz::require(to_toml(parse_piece(written, "written.toml")) == written);
    use(*make_piece(params));
  } catch (const ConfigError&) {
  } catch (const std::invalid_argument&) {  // what make_piece() promises
  }
  return 0;
}
