"""An open net of soft cotton yarn, which swags and folds at the width of a hand: parameters of the scenes that show it."""

from yarnverify.simulation.quantities import positive

k_s = positive(10.0, "N", "4 % of 2.5 N/tex: crimp straightens long before fibres stretch")
k_b = positive(3e-9, "N m^2", "500 fibres of cotton that slide freely, 6e-12 N m^2 each")
k_x = positive(5e-4, "N", "open net: 4 k_x/L = 0.5 N/m, a tenth of a light shirting")
rho = positive(1e-4, "kg/m", "cotton yarn of 100 tex")
L = positive(4e-3, "m", "scrim, 2.5 yarns a centimetre")
R = positive(0.5e-3, "m", "100 tex, hardly twisted: 130 kg/m^3")
