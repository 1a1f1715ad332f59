// The list of all effects: the only place where an effect is registered.
//
// The order matters where several effects act at one port: they act in this order, those of axes in
// the order X Y Z A C, and laws (law.hpp) after all of them.
#pragma once

#include <type_traits>

#include "model/effects/a_axis_offset.hpp"
#include "model/effects/a_axis_tilt.hpp"
#include "model/effects/acceleration_ff_error.hpp"
#include "model/effects/adc_noise.hpp"
#include "model/effects/ambient_cycle.hpp"
#include "model/effects/angular_errors.hpp"
#include "model/effects/backlash.hpp"
#include "model/effects/bus_jitter.hpp"
#include "model/effects/bus_latency.hpp"
#include "model/effects/bus_loss.hpp"
#include "model/effects/c_axis_offset.hpp"
#include "model/effects/c_axis_tilt.hpp"
#include "model/effects/cable_chain.hpp"
#include "model/effects/chord_error.hpp"
#include "model/effects/clock_drift.hpp"
#include "model/effects/cogging.hpp"
#include "model/effects/command_delay.hpp"
#include "model/effects/contact_loss.hpp"
#include "model/effects/corner_cutting.hpp"
#include "model/effects/coulomb.hpp"
#include "model/effects/cross_inertia.hpp"
#include "model/effects/cross_talk.hpp"
#include "model/effects/current_lag.hpp"
#include "model/effects/dropped_samples.hpp"
#include "model/effects/effect.hpp"
#include "model/effects/encoder_eccentricity.hpp"
#include "model/effects/encoder_quantisation.hpp"
#include "model/effects/encoder_subdivision.hpp"
#include "model/effects/frame_vibration.hpp"
#include "model/effects/friction_asymmetry.hpp"
#include "model/effects/friction_fade.hpp"
#include "model/effects/friction_zone.hpp"
#include "model/effects/grease_drag.hpp"
#include "model/effects/integral_time_error.hpp"
#include "model/effects/kv_error.hpp"
#include "model/effects/lateral_play.hpp"
#include "model/effects/lead_error.hpp"
#include "model/effects/load_encoder_error.hpp"
#include "model/effects/load_encoder_latency.hpp"
#include "model/effects/load_play.hpp"
#include "model/effects/lost_motion.hpp"
#include "model/effects/mains_hum.hpp"
#include "model/effects/motor_friction.hpp"
#include "model/effects/nonlinear_viscous.hpp"
#include "model/effects/path_filter.hpp"
#include "model/effects/period_slip.hpp"
#include "model/effects/piece_offset.hpp"
#include "model/effects/piece_tilt.hpp"
#include "model/effects/pitch_periodic.hpp"
#include "model/effects/pitch_progressive.hpp"
#include "model/effects/pivot_length.hpp"
#include "model/effects/presliding.hpp"
#include "model/effects/probe_drift.hpp"
#include "model/effects/probe_gain.hpp"
#include "model/effects/range_clip.hpp"
#include "model/effects/return_to_zero.hpp"
#include "model/effects/rotary_runout.hpp"
#include "model/effects/sample_jitter.hpp"
#include "model/effects/sample_latency.hpp"
#include "model/effects/scale_error.hpp"
#include "model/effects/signal_gain.hpp"
#include "model/effects/signal_harmonics.hpp"
#include "model/effects/signal_offset.hpp"
#include "model/effects/signal_phase.hpp"
#include "model/effects/squareness.hpp"
#include "model/effects/straightness.hpp"
#include "model/effects/stribeck.hpp"
#include "model/effects/structural_mode.hpp"
#include "model/effects/stylus_bending.hpp"
#include "model/effects/surface_friction.hpp"
#include "model/effects/thermal_drift.hpp"
#include "model/effects/thermal_expansion.hpp"
#include "model/effects/thermal_warm_up.hpp"
#include "model/effects/tip_lobing.hpp"
#include "model/effects/tip_radius.hpp"
#include "model/effects/torque_constant_error.hpp"
#include "model/effects/torque_limit.hpp"
#include "model/effects/torque_ripple.hpp"
#include "model/effects/transmission_error.hpp"
#include "model/effects/velocity_ff_error.hpp"
#include "model/effects/velocity_gain_error.hpp"
#include "model/effects/viscous.hpp"
#include "model/effects/weight_imbalance.hpp"
#include "model/effects/windup.hpp"

namespace vcnc {

template <class... Effect>
struct EffectList {};

using AllEffects = EffectList<
    // NC unit
    CornerCutting, ChordError, PathFilter,
    // bus: lost first, then late
    BusLoss, BusLatency, BusJitter,
    // servo and encoder
    CommandDelay, KvError, VelocityFfError, AccelerationFfError, IntegralTimeError,
    VelocityGainError, CurrentLag, TorqueLimit, LoadEncoderLatency, LoadEncoderError,
    EncoderEccentricity, EncoderSubdivision, EncoderQuantisation,
    // force of the motor
    TorqueConstantError, TorqueRipple, Cogging,
    // transmission
    Windup, Backlash, LeadError, TransmissionError, MotorFriction,
    // friction: terms first, then what changes them
    Coulomb, Stribeck, GreaseDrag, Viscous, NonlinearViscous, Presliding, FrictionAsymmetry,
    FrictionZone, FrictionFade,
    // further forces on the load
    WeightImbalance, CableChain,
    // tool centre against scale
    ScaleError, PitchPeriodic, PitchProgressive, LoadPlay, LostMotion, StructuralMode,
    ThermalExpansion, ThermalWarmUp, ThermalDrift, AmbientCycle,
    // pose: guides, rotary axes, frame, piece
    Straightness, AngularErrors, LateralPlay, Squareness, PivotLength, RotaryRunout, AAxisOffset,
    AAxisTilt, CAxisOffset, CAxisTilt, CrossInertia, FrameVibration, PieceOffset, PieceTilt,
    // ball and surface
    TipRadius, TipLobing, SurfaceFriction, ReturnToZero, ContactLoss,
    // deflection: stylus, sensor, then when it is sampled
    StylusBending, ProbeGain, CrossTalk, ProbeDrift, RangeClip, SampleLatency, ClockDrift,
    SampleJitter,
    // analogue signals: their form, then how they swing, then what is added
    SignalHarmonics, SignalPhase, SignalGain, SignalOffset, MainsHum, AdcNoise,
    // counters and messages
    PeriodSlip, DroppedSamples>;

/// Calls f(std::type_identity<Effect>()) for every effect, in order.
template <class F, class... Effect>
void for_each_effect(EffectList<Effect...>, F&& f) {
  (f(std::type_identity<Effect>()), ...);
}
template <class F>
void for_each_effect(F&& f) {
  for_each_effect(AllEffects(), f);
}

}  // namespace vcnc
