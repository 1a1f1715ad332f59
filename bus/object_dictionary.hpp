// The object dictionary of a CANopen device (CiA 301): everything that can be read and written by
// SDO, one line per object.
//
// A line says index, sub-index, name, data type, access, unit of one count, and where the value
// lives: a function that reads it and, if it is writable, one that writes it. Values are integers
// of the type's width, little-endian on the wire, or text. Nothing is copied: what is read is what
// holds at that moment, what is written acts.
//
// An index has either one line with sub-index 0, or is headed by record() or array(), which adds
// sub-index 0, the highest sub-index there is.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace vcnc {

/// Data types by their code in CiA 301.
enum class ObjectType : std::uint16_t {
  boolean = 0x01,
  i8 = 0x02,
  i16 = 0x03,
  i32 = 0x04,
  u8 = 0x05,
  u16 = 0x06,
  u32 = 0x07,
  text = 0x09,  ///< VISIBLE_STRING
  i48 = 0x13,
  i64 = 0x15,
  u48 = 0x19,
  u64 = 0x1b
};

enum class ObjectAccess { constant, read_only, read_write };

/// Why a transfer is refused or broken off (CiA 301, SDO abort codes).
enum class SdoAbort : std::uint32_t {
  none = 0,
  toggle = 0x05030000,
  timed_out = 0x05040000,
  command = 0x05040001,
  access = 0x06010000,
  write_only = 0x06010001,
  read_only = 0x06010002,
  no_object = 0x06020000,
  length = 0x06070010,
  too_long = 0x06070012,
  too_short = 0x06070013,
  no_sub_index = 0x06090011,
  value = 0x06090030,
  too_high = 0x06090031,
  too_low = 0x06090032,
  device_state = 0x08000022
};

/// One line of the dictionary.
struct ObjectEntry {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::string name;
  ObjectType type = ObjectType::u32;
  ObjectAccess access = ObjectAccess::read_only;
  std::string unit;  ///< of one count, "0.1 um"; empty: a plain number
  std::function<std::int64_t()> get{};
  std::function<SdoAbort(std::int64_t)> set{};  ///< for read_write; after the range check
  std::int64_t least = std::numeric_limits<std::int64_t>::min();
  std::int64_t most = std::numeric_limits<std::int64_t>::max();
  std::function<std::string()> get_text{};  ///< for text instead of get and set
  std::function<SdoAbort(const std::string&)> set_text{};
};

/// What stands under one index.
struct ObjectHead {
  enum class Code : std::uint8_t { variable = 7, array = 8, record = 9 };
  std::uint16_t index = 0;
  std::string name;
  Code code = Code::variable;
};

using ObjectBytes = std::vector<std::uint8_t>;

class ObjectDictionary {
 public:
  static constexpr std::size_t kLongestText = 64;  ///< that can be written

  ObjectDictionary() = default;
  ObjectDictionary(const ObjectDictionary&) = delete;
  ObjectDictionary& operator=(const ObjectDictionary&) = delete;

  /// Throws std::logic_error for a line that exists already, cannot be read, or belongs to no
  /// index.
  void add(ObjectEntry entry);
  /// Heads an index with several sub-indices and gives it sub-index 0.
  void record(std::uint16_t index, std::string name,
              ObjectHead::Code code = ObjectHead::Code::record);
  /// The same with a sub-index 0 of its own.
  void record(std::uint16_t index, std::string name, ObjectHead::Code code, ObjectEntry first);
  void array(std::uint16_t index, std::string name) {
    record(index, std::move(name), ObjectHead::Code::array);
  }

  const ObjectEntry* find(std::uint16_t index, std::uint8_t sub) const;
  bool has(std::uint16_t index) const;
  const std::vector<ObjectEntry>& entries() const { return entries_; }  ///< in ascending order
  const std::vector<ObjectHead>& heads() const { return heads_; }       ///< in ascending order

  /// The value as it travels.
  SdoAbort read(std::uint16_t index, std::uint8_t sub, ObjectBytes& bytes) const;
  SdoAbort write(std::uint16_t index, std::uint8_t sub, const ObjectBytes& bytes) const;
  /// Whether a write of this many bytes could succeed.
  SdoAbort may_write(std::uint16_t index, std::uint8_t sub, std::size_t size) const;

 private:
  SdoAbort missing(std::uint16_t index) const;

  std::vector<ObjectEntry> entries_;
  std::vector<ObjectHead> heads_;
};

/// Bytes of a value on the wire; text: 0.
int size_of(ObjectType type);
bool is_signed(ObjectType type);
/// "INTEGER32", as CiA 301 writes it.
std::string_view name_of(ObjectType type);
/// The integer type of this width; throws std::logic_error if there is none.
ObjectType integer_type(int bytes, bool with_sign);
/// One sentence for people.
std::string_view text_of(SdoAbort abort);

/// What one count stands for: "0.1 um", "1e-08 m/s".
std::string unit_of_count(double per_count, std::string_view unit);
/// A physical value in counts, saturated to 32 bit.
std::int64_t counts(double value, double per_unit);

}  // namespace vcnc
