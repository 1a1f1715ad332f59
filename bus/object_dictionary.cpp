#include "bus/object_dictionary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace vcnc {

namespace {

struct TypeText {
  ObjectType type;
  int bytes;
  bool with_sign;
  std::string_view name;
};
constexpr std::array<TypeText, 12> kTypes{{
    {ObjectType::boolean, 1, false, "BOOLEAN"},
    {ObjectType::u8, 1, false, "UNSIGNED8"},
    {ObjectType::u16, 2, false, "UNSIGNED16"},
    {ObjectType::u32, 4, false, "UNSIGNED32"},
    {ObjectType::u48, 6, false, "UNSIGNED48"},
    {ObjectType::u64, 8, false, "UNSIGNED64"},
    {ObjectType::i8, 1, true, "INTEGER8"},
    {ObjectType::i16, 2, true, "INTEGER16"},
    {ObjectType::i32, 4, true, "INTEGER32"},
    {ObjectType::i48, 6, true, "INTEGER48"},
    {ObjectType::i64, 8, true, "INTEGER64"},
    {ObjectType::text, 0, false, "VISIBLE_STRING"},
}};

const TypeText& text_of_type(ObjectType type) {
  return *std::find_if(kTypes.begin(), kTypes.end(),
                       [type](const TypeText& t) { return t.type == type; });
}

std::uint32_t key(std::uint16_t index, std::uint8_t sub) {
  return static_cast<std::uint32_t>(index) << 8 | sub;
}

std::int64_t value_of(const ObjectBytes& bytes, bool with_sign) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
  const auto unused = static_cast<int>(64 - 8 * bytes.size());
  if (with_sign && unused > 0) return static_cast<std::int64_t>(bits << unused) >> unused;
  return static_cast<std::int64_t>(bits);
}

}  // namespace

int size_of(ObjectType type) { return text_of_type(type).bytes; }
bool is_signed(ObjectType type) { return text_of_type(type).with_sign; }
std::string_view name_of(ObjectType type) { return text_of_type(type).name; }

ObjectType integer_type(int bytes, bool with_sign) {
  for (const TypeText& t : kTypes)
    if (t.type != ObjectType::boolean && t.bytes == bytes && t.with_sign == with_sign)
      return t.type;
  throw std::logic_error("no integer type of " + std::to_string(bytes) + " bytes");
}

std::string_view text_of(SdoAbort abort) {
  switch (abort) {
    case SdoAbort::none:
      return "no abort";
    case SdoAbort::toggle:
      return "toggle bit not alternated";
    case SdoAbort::timed_out:
      return "SDO protocol timed out";
    case SdoAbort::command:
      return "command specifier not valid or unknown";
    case SdoAbort::access:
      return "unsupported access to an object";
    case SdoAbort::write_only:
      return "attempt to read a write-only object";
    case SdoAbort::read_only:
      return "attempt to write a read-only object";
    case SdoAbort::no_object:
      return "object does not exist";
    case SdoAbort::length:
      return "length does not match";
    case SdoAbort::too_long:
      return "length too high";
    case SdoAbort::too_short:
      return "length too low";
    case SdoAbort::no_sub_index:
      return "sub-index does not exist";
    case SdoAbort::value:
      return "invalid value";
    case SdoAbort::too_high:
      return "value too high";
    case SdoAbort::too_low:
      return "value too low";
    case SdoAbort::device_state:
      return "not possible in the present device state";
  }
  return "unknown abort code";
}

std::string unit_of_count(double per_count, std::string_view unit) {
  if (unit.empty()) return per_count == 1 ? "" : fmt::format("{:g}", per_count);
  return fmt::format("{:g} {}", per_count, unit == "m|rad" ? "m or rad" : unit);
}

std::int64_t counts(double value, double per_unit) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  const double n = value * per_unit;
  if (std::isnan(n)) return 0;
  return std::llrint(std::clamp(n, -kMost, kMost));
}

void ObjectDictionary::add(ObjectEntry entry) {
  const std::string where = entry.name;
  const bool text = entry.type == ObjectType::text;
  if (text ? !entry.get_text : !entry.get)
    throw std::logic_error("object " + where + " cannot be read");
  if (entry.access == ObjectAccess::read_write && (text ? !entry.set_text : !entry.set))
    throw std::logic_error("object " + where + " cannot be written");
  if (find(entry.index, entry.sub)) throw std::logic_error("object " + where + " exists twice");
  if (!has(entry.index)) {
    if (entry.sub != 0) throw std::logic_error("object " + where + " belongs to no index");
    const auto at =
        std::lower_bound(heads_.begin(), heads_.end(), entry.index,
                         [](const ObjectHead& h, std::uint16_t index) { return h.index < index; });
    heads_.insert(at, {entry.index, entry.name, ObjectHead::Code::variable});
  }
  const auto at = std::lower_bound(
      entries_.begin(), entries_.end(), key(entry.index, entry.sub),
      [](const ObjectEntry& e, std::uint32_t k) { return key(e.index, e.sub) < k; });
  entries_.insert(at, std::move(entry));
}

void ObjectDictionary::record(std::uint16_t index, std::string name, ObjectHead::Code code,
                              ObjectEntry first) {
  if (has(index)) throw std::logic_error("object " + name + " exists twice");
  const auto at =
      std::lower_bound(heads_.begin(), heads_.end(), index,
                       [](const ObjectHead& h, std::uint16_t i) { return h.index < i; });
  heads_.insert(at, {index, std::move(name), code});
  add(std::move(first));
}

void ObjectDictionary::record(std::uint16_t index, std::string name, ObjectHead::Code code) {
  record(index, std::move(name), code,
         {.index = index,
          .name = "Highest sub-index supported",
          .type = ObjectType::u8,
          .access = ObjectAccess::constant,
          .unit = "",
          .get = [this, index] {
            std::int64_t highest = 0;
            for (const ObjectEntry& e : entries_)
              if (e.index == index) highest = e.sub;
            return highest;
          }});
}

const ObjectEntry* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto at = std::lower_bound(
      entries_.begin(), entries_.end(), key(index, sub),
      [](const ObjectEntry& e, std::uint32_t k) { return key(e.index, e.sub) < k; });
  return at != entries_.end() && at->index == index && at->sub == sub ? &*at : nullptr;
}

bool ObjectDictionary::has(std::uint16_t index) const {
  const auto at =
      std::lower_bound(heads_.begin(), heads_.end(), index,
                       [](const ObjectHead& h, std::uint16_t i) { return h.index < i; });
  return at != heads_.end() && at->index == index;
}

SdoAbort ObjectDictionary::missing(std::uint16_t index) const {
  return has(index) ? SdoAbort::no_sub_index : SdoAbort::no_object;
}

SdoAbort ObjectDictionary::read(std::uint16_t index, std::uint8_t sub, ObjectBytes& bytes) const {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return missing(index);
  bytes.clear();
  if (entry->type == ObjectType::text) {
    const std::string text = entry->get_text();
    bytes.assign(text.begin(), text.end());
    return SdoAbort::none;
  }
  const auto value = static_cast<std::uint64_t>(entry->get());
  for (int i = 0; i < size_of(entry->type); ++i)
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  return SdoAbort::none;
}

SdoAbort ObjectDictionary::may_write(std::uint16_t index, std::uint8_t sub,
                                     std::size_t size) const {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return missing(index);
  if (entry->access != ObjectAccess::read_write) return SdoAbort::read_only;
  if (entry->type == ObjectType::text)
    return size <= kLongestText ? SdoAbort::none : SdoAbort::too_long;
  const auto needed = static_cast<std::size_t>(size_of(entry->type));
  return size > needed ? SdoAbort::too_long : size < needed ? SdoAbort::too_short : SdoAbort::none;
}

SdoAbort ObjectDictionary::write(std::uint16_t index, std::uint8_t sub,
                                 const ObjectBytes& bytes) const {
  if (const SdoAbort refused = may_write(index, sub, bytes.size()); refused != SdoAbort::none)
    return refused;
  const ObjectEntry& entry = *find(index, sub);
  if (entry.type == ObjectType::text) {
    const bool printable = std::all_of(bytes.begin(), bytes.end(),
                                       [](std::uint8_t c) { return c >= 0x20 && c < 0x7f; });
    return printable ? entry.set_text(std::string(bytes.begin(), bytes.end())) : SdoAbort::value;
  }
  const std::int64_t value = value_of(bytes, is_signed(entry.type));
  if (value > entry.most) return SdoAbort::too_high;
  if (value < entry.least) return SdoAbort::too_low;
  return entry.set(value);
}

}  // namespace vcnc
