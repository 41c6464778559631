// Gives the probability that a sum of squared unit normal deviates is larger than a value seen.
//
// Model: Q(k/2, x/2), the upper regularised incomplete gamma function, by its series below the mean and by Lentz's
// continued fraction above it (Numerical Recipes in C, 2nd ed., section 6.2).
// Validity: k >= 1, x >= 0, relative error below 1e-12; returns 1 for x <= 0 and 0 where the result underflows.
// Threads: pure.
// Cost: about sqrt(k) steps.
#pragma once

namespace lambdajet::calibration {

double ChiSquareUpperTail(double chi_square, double degrees_of_freedom);

}  // namespace lambdajet::calibration
