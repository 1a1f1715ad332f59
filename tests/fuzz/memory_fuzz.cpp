// What a machine keeps while it is off. The first byte says where the first slot ends; what follows
// are both slots, or the state inside of one.
//
// Whatever they hold: a slot that counts is written back with the same bytes, the one that does not
// is the one to be overwritten, and a state that decodes is written back with the same bytes, or by
// the present version.
#include "bus/memory_slot.hpp"
#include "controller/gcode/nc_data.hpp"
#include "controller/nc_record.hpp"
#include "fuzz.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace {

using namespace vcnc;
using Bytes = std::span<const std::uint8_t>;

bool same(Bytes a, Bytes b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

void check_state(Bytes state) {
  if (const auto record = decode_record(state)) {
    fuzz::require(same(encode_record(*record), state));
    fuzz::require(text_of(record->stage)[0] != 0);
  }
  if (const auto data = decode_nc_data(state)) {
    // What an older version wrote is written back as the present one.
    const std::vector<std::uint8_t> written = encode_nc_data(*data);
    const auto again = decode_nc_data(written);
    fuzz::require(again && same(encode_nc_data(*again), written));
    fuzz::require(state[0] == 1 || same(written, state));
  }
  if (const auto locked = decode_spindle_lock(state))
    fuzz::require(same(encode_spindle_lock(*locked), state));
  if (const auto latch = decode_protection_latch(state))
    fuzz::require(same(encode_protection_latch(*latch), state));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes input(data, size);
  const std::size_t first_size = input.byte();
  const Bytes first = input.take(first_size), second = input.rest();
  const SlotChoice choice = newest_slot(first, second);
  if (choice.newest) {
    const Bytes kept = choice.write_to == 0 ? second : first;
    fuzz::require(same(encode_slot(*choice.newest), kept));
    check_state(choice.newest->state);
  } else {
    fuzz::require(!choice.why[0].empty() && !choice.why[1].empty());
  }
  check_state(second);
  return 0;
}
