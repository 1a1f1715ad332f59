// Arithmetic on a series with gaps: what is missing is NaN and stays so, where nothing else is
// said.
#pragma once

#include <cstddef>
#include <vector>

namespace vcnc {

/// What is missing becomes what was before it, at the beginning what comes first.
void hold_over_gaps(std::vector<double>& series);

/// Means of what is known of 2 reach + 1 samples, fewer at the ends.
std::vector<double> moving_mean(const std::vector<double>& series, std::size_t reach);

/// By the samples before and after [unit/s], period [s]; missing at the ends.
std::vector<double> first_derivative(const std::vector<double>& series, double period);

/// By differences of neighbours [unit/s^2], period [s]; missing at the ends.
std::vector<double> second_derivative(const std::vector<double>& series, double period);

/// Of what is known; 0: nothing is.
double mean_square(const std::vector<double>& series);

/// A series, moved to have the mean that another has where both are known.
std::vector<double> with_mean_of(const std::vector<double>& other, std::vector<double> series);

/// Mean square of what a series is off its moving mean.
double mean_square_off_mean(const std::vector<double>& series, std::size_t reach);

}  // namespace vcnc
