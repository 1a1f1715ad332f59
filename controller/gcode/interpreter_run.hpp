// The inside of the interpreter, shared by its source files.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/gcode/block_words.hpp"
#include "controller/gcode/cutter_compensation.hpp"
#include "controller/gcode/expression.hpp"
#include "controller/gcode/flow_index.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/gcode/parameters.hpp"
#include "controller/gcode/work_coordinates.hpp"

namespace vcnc {

/// What holds until something else is said.
struct GcodeModal {
  enum class Length { none, offset, rtcp, vector };
  int motion = 800;  ///< G code in tenths
  std::size_t normal = kZ;
  double length_unit = 1e-3;
  bool absolute = true, arc_absolute = false;
  int feed = 940;
  bool exact = false;
  double tolerance = 0;
  NcParams::Dynamics dynamics = NcParams::Dynamics::smooth;
  bool to_initial = true;  ///< G98
  Length length = Length::none;
  double tool_length = 0;                   ///< of the RTCP frame
  double linear_feed = 0, rotary_feed = 0;  ///< [m/s], [rad/s] (G93: 1/s; G95: m per turn); 0: none
  double spindle_speed = 0;                 ///< [rad/s]
  int spindle = 5;                          ///< M3, M4, M5, M19
  std::optional<SurfaceSpeed> surface;      ///< G96
  double speed_limit = 0;                   ///< Fanuc's G92 S [rad/s]; 0: none
  bool feed_override = true;                ///< M48, M50
};

/// R, Z, Q, P of canned cycles hold while cycles follow each other.
struct CycleWords {
  std::optional<double> r, z, q, p;
  int code = -1;                  ///< of the last one
  std::optional<double> initial;  ///< height before the first of them
};

/// How directions in the active plane lie in the frame.
struct PlaneMap {
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  double scale = 1;
  bool mirrored = false;
};

/// G16: what the words of the plane count from, and the last ones.
struct PolarWords {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius = 0, angle = 0;
};

/// G51 and G51.1, in the words of the program.
struct ScalingWords {
  Vec3 factor = Vec3::Ones(), centre = Vec3::Zero(), mirror = Vec3::Zero();
  std::array<bool, 3> mirrored{};
};

class ProgramRun : public SystemParameters {
 public:
  ProgramRun(const std::string& path, const Machine& machine, InterpreterOptions options);
  Block next();
  BlockStart run_to(int line);
  long passes_of(int line);
  void probed(const ProbeTouch& touch);
  const ProbeTouch& probing() const { return probing_; }
  void forget_touches() { options_.touches.clear(); }
  NcData data() const;
  bool inches() const { return modal_.length_unit != 1e-3; }
  void block_delete(bool on) { options_.block_delete = on; }

 private:
  using Dialect = InterpreterOptions::Dialect;
  /// How the number of an axis word counts.
  enum class Way : std::uint8_t { modal, absolute, incremental, shortest, upwards, downwards };
  using Flow = FlowLine::Kind;
  enum class SiemensFrame { none, trans, atrans, rot, arot, scale, ascale, mirror, amirror };
  enum class Search { forwards, backwards, around };

  struct Unit {
    Unit(const std::string& path, bool siemens) : text(path), flow(text, siemens) {}
    ProgramText text;
    FlowIndex flow;
    bool opened = false;  ///< its first % was seen
  };
  struct Counter {
    int begin;
    long left;
  };
  struct Call {
    std::size_t unit = 0;
    ProgramPlace back;   ///< where the caller goes on
    ProgramPlace begin;  ///< of the program called, for repeats
    long repeats = 0;    ///< still to do
    bool macro = false;  ///< M98 or G65: ends with M99
    bool own_locals = false;
    LocalParameters locals;  ///< of the caller
    std::vector<Counter> counters;
    std::optional<GcodeModal> modal;  ///< M73
  };

  // reading: interpreter.cpp
  void read_line();
  void read_guarded();
  int column_of_block() const;
  bool about_to_read(int line) const;
  bool read_words(Cursor& at);
  void read_letter(Cursor& at);
  void refuse_word(Cursor& at) const;
  bool read_keyword(Cursor& at);
  void read_assignment(Cursor& at);
  void apply_assignments();
  void execute();
  void end_of_file();
  void finish();
  [[noreturn]] void fail(const std::string& reason, int column = 0) const;
  int line_number() const { return unit().text.last().line; }
  Unit& unit() { return *units_[unit_]; }
  const Unit& unit() const { return *units_[unit_]; }

  // flow: interpreter_flow.cpp
  void steer(int i, Cursor at);
  void go_to(const ProgramPlace& place);
  void count_pass();
  void call_sub(const std::string& label, Cursor& at);
  void return_from_sub(Cursor& at, bool with_value);
  void call_program(int number, long repeats, bool macro_locals);
  void call_modal_macro();
  void return_from_program();
  void load_arguments(LocalParameters& locals);
  void jump_to_label(double number, int column);
  bool jump(const std::string& name, Search search);
  bool is_named(std::string_view line, const std::string& name) const;
  void execute_macro_words();
  std::size_t find_unit(const std::vector<std::string>& names);
  std::vector<std::string> program_folders() const;
  std::string where_sought() const;
  void enter_call(Call call, std::size_t unit, const ProgramPlace& place);
  void leave_call();
  double condition(Cursor& at);

  // modes: interpreter_modes.cpp
  void set_modes();
  void set_path_mode();
  void set_dynamics();
  void set_high_speed();
  bool take_dynamics(Cursor& at);
  void set_feed();
  void set_spindle();
  void set_surface_speed();
  void emit_spindle(int code);
  void check_speed(double rpm) const;
  double spindle_speed_at(double x) const;
  void set_tool();
  void set_outputs();
  void set_tool_length();
  void set_cutter();
  void set_offsets();
  void set_rotation();
  void set_polar();
  void set_scaling();
  double scale_factor(char letter) const;
  void set_tilt();
  void set_modal_stack();
  void set_by_g10();
  void set_further_offset(int p, int column);
  void set_g92();
  void enter_frame();
  MotionFrame frame() const;
  const ToolEntry& tool(double number, char letter);
  void need_no_compensation(const char* what, int column) const;
  void need_no_scaling(const char* what, int column) const;

  // motion: interpreter_motion.cpp
  void emit_motion();
  void emit_straight(int code);
  void emit_arc();
  int column_of_arc() const;
  void emit_probe(int code);
  const ProbeTouch* known_touch() const;
  void emit_thread(int code);
  void emit_reference_return(int code);
  void emit_tool_align();
  void emit_dwell();
  Coordinates target(bool machine_coordinates = false);
  void put_polar(Coordinates& words);
  PlaneMap plane_map(const char* what) const;
  void take_tool_vector(Coordinates& end);
  Arc arc_to(const Coordinates& end);
  void set_move_feed(Move& move) const;
  void emit_move(Move move);
  void emit(Block block);
  bool absolute(char letter) const {
    const Way way = way_[static_cast<std::size_t>(letter - 'A')];
    return way == Way::modal ? modal_.absolute : way != Way::incremental;
  }
  double length(char letter) const { return words_.value(letter) * modal_.length_unit; }
  double in_si(std::size_t axis, double word) const {
    return word * (is_rotary(axis) ? kDegree : modal_.length_unit);
  }

  // the dialect of Siemens: interpreter_siemens.cpp
  bool read_siemens_word(Cursor& at);
  bool read_siemens_jump(Cursor& at);
  bool read_siemens_frame(Cursor& at);
  void set_siemens_frame();
  int siemens_loop_variable(Cursor& at) const;
  bool siemens_loop_goes_on(Cursor& at, int variable) const;
  static std::string take_siemens_label(Cursor& at);
  Arc arc_along_tangent(const Coordinates& end);
  void turn_tangent(const Move& move);
  bool read_siemens_address(char letter, Cursor& at, int column);
  double siemens_value(char letter, Cursor& at);
  bool siemens_code(double& number) const;
  static double turned(double to, double from, Way way);
  Coordinates via_point() const;
  Arc arc_through_point(const Coordinates& end);

  // canned cycles: interpreter_cycles.cpp
  void emit_cycle(int code);
  void cycle_move(const Coordinates& words, Move::Kind kind);
  void cycle_bottom(int code, Coordinates at, double bottom, double clear, double plane);
  void cycle_dwell(double seconds);
  void cycle_spindle(int code);

  // parameters: interpreter_parameters.cpp
  std::optional<double> read(int number) const override;
  std::optional<double> read(std::string_view name) const override;
  bool write(int number, double value) override;
  std::optional<double> siemens_variable(std::string_view name) const;
  double* system_value(int number, double& to_si);
  double* kept_value(int number);
  std::map<int, double> offset_parameters() const;
  void take_over(const NcData& data);

  const Machine machine_;
  InterpreterOptions options_;
  bool fanuc_ = false, siemens_dialect_ = false;
  std::vector<std::unique_ptr<Unit>> units_;
  std::size_t unit_ = 0;
  Parameters parameters_;
  Evaluator evaluator_;

  BlockWords words_;
  int number_ = 0;                  ///< N
  std::array<double, 3> vector_{};  ///< A3= B3= C3=
  unsigned vector_given_ = 0;
  int siemens_ = 0;                                  ///< TRAORI: 1, TRAFOOF: 2
  SiemensFrame siemens_frame_ = SiemensFrame::none;  ///< of this block
  std::optional<double> rpl_;                        ///< RPL=
  bool measures_ = false;                            ///< MEAS=
  Vec3 tangent_ = Vec3::Zero();  ///< in which the last motion ended, of length 1; 0: none
  std::array<Way, 26> way_{};    ///< by letter
  std::array<double, 3> via_{};  ///< I1= J1= K1=
  unsigned via_given_ = 0;
  struct Assignment {
    int number;  ///< -1: by name
    std::string name;
    double value;
    int column;
  };
  std::vector<Assignment> assignments_;
  std::string_view line_;

  GcodeModal modal_;
  std::optional<GcodeModal> saved_;  ///< M70 outside every call
  WorkCoordinates work_;
  ToolTable tools_;
  std::map<int, double> begin_offsets_;  ///< of the machine file
  std::map<int, ToolEntry> begin_tools_;
  int selected_tool_ = 0, tool_in_spindle_ = 0, h_ = 0, d_ = 0;
  Coordinates home_, second_home_;  ///< G28, G30 [m, rad]
  Coordinates probed_ = Coordinates::Zero();
  double probe_success_ = 0, input_ = 0;
  ProbeTouch probing_;        ///< the last probing move, as it is taken to have ended
  std::size_t probings_ = 0;  ///< how many so far
  int guessed_ = 0;           ///< line of the first whose contact was taken to be its end
  std::optional<double> returned_;
  bool tilted_ = false;
  std::optional<PolarWords> polar_;  ///< G16
  ScalingWords scaling_;
  CutterCompensation compensation_;
  CycleWords cycle_;
  std::vector<Call> calls_;
  std::vector<Counter> counters_;
  LocalParameters modal_macro_locals_;
  int modal_macro_ = 0;  ///< G66: program number
  std::map<std::string, ProgramPlace> labels_;

  MotionFrame frame_;
  FrameMap map_;
  Coordinates position_;  ///< in frame_
  std::vector<Block> ready_;
  std::size_t ready_at_ = 0;
  long passes_ = 0;
  bool ended_ = false;
};

}  // namespace vcnc
