#include "controller/alarms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "bus/messages.hpp"

namespace vcnc {
namespace {

constexpr std::array kTexts{
    AlarmText{
        AlarmCode::overtravel_hard, "Overtravel: quick stop, spindle locked",
        "the overtravel module saw the probe's protection unit switch, a deflection or force at "
        "its mechanical limit, a faulty or lost signal, or a soft stop that was not obeyed",
        "drive the probe off by hand; look for a wrong work offset, stylus length or program; "
        "check stylus and cable; then reset"},
    AlarmText{
        AlarmCode::overtravel_hard_nc, "Overtravel: quick stop by the NC unit's own check",
        "the same, seen by the NC unit in the probe's samples before or without the overtravel "
        "module",
        "as 1001; if 1001 did not come too, check the overtravel module"},
    AlarmText{AlarmCode::overtravel_soft, "Probe out of its range: stopped and retracted",
              "the overtravel module saw the deflection leave the usable range",
              "the probe has been retracted; correct predeflection, offset or program; then reset"},
    AlarmText{AlarmCode::overtravel_soft_nc,
              "Probe out of its range: stopped and retracted by the NC unit's own check",
              "the same, seen by the NC unit in the probe's samples", "as 1003"},
    AlarmText{AlarmCode::drive_left_operation, "A drive left operation",
              "its statusword no longer shows operation enabled and no emergency told why",
              "read the statusword in the alarm; look for earlier alarms of the drive"},
    AlarmText{AlarmCode::drives_not_enabled, "The drives could not be enabled",
              "a drive did not reach operation enabled within 0.2 s after switch-on",
              "look for a drive in fault; reset it; check its supply"},
    AlarmText{AlarmCode::following_error, "Following error",
              "an axis lags its set-point by more than its window (following_window): blocked, "
              "overloaded, or badly tuned",
              "look for a collision or a force at its limit; check gains and the window; reset"},
    AlarmText{AlarmCode::limit_switch, "Limit switch",
              "an axis has run onto the switch outside its travel",
              "reset and drive it back; check work offset and travel limits"},
    AlarmText{AlarmCode::command_lost, "A drive gets no command",
              "no usable group command from the NC unit for more than two cycles",
              "check the bus; look at the NC unit's own alarms"},
    AlarmText{
        AlarmCode::overtravel_module_lost, "A drive hears no overtravel module",
        "the overtravel module fell silent for more than two cycles while it guarded the machine",
        "restart the module; check the bus; no program starts without it"},
    AlarmText{AlarmCode::drive_fault, "Drive fault",
              "the drive stopped by itself: overcurrent or another fault of its power stage",
              "look at the drive; check motor and cables; reset"},
    AlarmText{
        AlarmCode::spindle_locked, "The spindle is locked",
        "a start was asked for while the protection holds the spindle, maybe since before the "
        "machine was switched on",
        "clear what has locked it first, then reset (`vcnc reset` where it is kept)"},
    AlarmText{AlarmCode::module_emergency, "A module raised an emergency",
              "an emergency message with a code that has no text of its own",
              "look up the code in CiA 301 or the module's manual"},
    AlarmText{
        AlarmCode::communication_disturbed, "Communication disturbed",
        "a module missed a SYNC, got one twice, got two frames of one sender in a cycle or one of "
        "wrong length, or was error passive or bus-off",
        "check cabling, bit rates and other participants of the bus"},
    AlarmText{AlarmCode::frames_lost, "Frames lost by the host",
              "the host of a module could not take frames fast enough",
              "run slower (--pace), free the host of other work"},
    AlarmText{
        AlarmCode::bus_overloaded, "Bus overloaded by frames that do not belong there",
        "for more than two cycles the bus carried foreign or repeated frames and more than fits "
        "into a cycle: a babbling module",
        "find the sender by the identifier in the alarm; unplug it"},
    AlarmText{AlarmCode::module_gone, "A module has left the bus",
              "its program ended, restarted or did not answer the host in time; quick stop",
              "start the machine again; look at the last words of the module's program"},
    AlarmText{
        AlarmCode::module_silent, "A module has fallen silent",
        "no valid and timely frame of it for more than two cycles: unplugged, bus off, or its "
        "frames are lost, late or spoiled; quick stop",
        "check cable, connector and supply of the module named"},
    AlarmText{
        AlarmCode::heartbeat_lost, "Heartbeat lost",
        "a module did not show its heartbeat for three of its periods, showed another state than "
        "operational, or does not hear that of the NC unit; quick stop",
        "look whether somebody changed 1016h or 1017h or sent an NMT command; check the module "
        "named"},
    AlarmText{AlarmCode::mains_lost, "Mains lost",
              "the supply's power-fail signal; feed hold, then the probe is retracted from what it "
              "touches",
              "none at once: the machine lives on its supply; see to the mains"},
    AlarmText{AlarmCode::mains_back, "Mains are back", "the power-fail signal has gone",
              "none; --on-power-return says whether the program ends or goes on"},
    AlarmText{
        AlarmCode::supply_exhausted, "Supply exhausted, everything is dark",
        "the mains were away for longer than the store of the supply lasts; the alarm says "
        "what had been reached by then",
        "switch on again; with --memory the program goes on by --resume; if the probe still "
        "touched, drive it off by hand first; a larger store if it was not retracted in time"},
    AlarmText{AlarmCode::secured, "Held and retracted, waiting for the mains",
              "after 4001: the axes stand, the probe is free, with --memory the state is saved",
              "wait for the mains, or switch off and go on later by --resume"},
    AlarmText{AlarmCode::resumed, "An interrupted program goes on",
              "the mains came back with --on-power-return resume, or the run began with --resume",
              "none; this run or the one before holds the other part of the path"},
    AlarmText{
        AlarmCode::program_refused, "The program cannot go on",
        "what a probing move has found, or block delete switched while it ran, has made other "
        "blocks of it than were checked, and they do not fit",
        "look at the line named; check what was probed, and the program with and without "
        "--block-delete"},
    AlarmText{
        AlarmCode::probe_no_contact, "A probing move has come to its end",
        "G38.2: the probe has not touched on the way; G38.4: it has not let go",
        "look at the place of the piece, the work offset and the end of the move; G38.3, G38.5 "
        "and G31 go on"},
    AlarmText{AlarmCode::probe_at_begin, "A probing move has nothing to look for",
              "where it begins the probe touches already, or, for G38.4 and G38.5, is free; its "
              "reading has had 0.1 s to settle",
              "begin farther away; look whether the move before has run into the piece"},
};

}  // namespace

std::span<const AlarmText> alarm_texts() { return kTexts; }

const AlarmText& alarm_text(AlarmCode code) {
  const auto found = std::find_if(kTexts.begin(), kTexts.end(),
                                  [&](const AlarmText& t) { return t.code == code; });
  if (found == kTexts.end()) throw std::logic_error("an alarm without a text");
  return *found;
}

AlarmCode alarm_of_emergency(std::uint16_t code, std::uint8_t detail) {
  switch (code) {
    case 0x8611:
      return AlarmCode::following_error;
    case 0x8612:
      return AlarmCode::limit_switch;
    case 0x8250:
      return AlarmCode::command_lost;
    case kHeartbeatLost:
      return detail == kNcNode ? AlarmCode::heartbeat_lost : AlarmCode::overtravel_module_lost;
    case 0x2310:
      return AlarmCode::drive_fault;
    case kCommunicationError:
    case kErrorPassive:
    case kBusOffRecovered:
    case kPdoLengthError:
      return AlarmCode::communication_disturbed;
    case kOverrunError:
      return AlarmCode::frames_lost;
    default:
      return AlarmCode::module_emergency;
  }
}

std::string alarms_markdown() {
  std::string text = "# Alarms\n\n| number | text | cause | remedy |\n|---|---|---|---|\n";
  for (const AlarmText& a : kTexts)
    text += fmt::format("| {} | {} | {} | {} |\n", static_cast<int>(a.code), a.title, a.cause,
                        a.remedy);
  return text;
}

}  // namespace vcnc
