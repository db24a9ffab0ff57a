//! Bibliography (documentation only). Other modules cite these entries by name.
//!
//! - **Ingole & Chatterjee**: "Structural joint modeling and identification: numerical and
//!   experimental investigation". The method: frequency equations by substructure synthesis and
//!   the multi-linear regression over mode pairs.
//! - **Bishop & Johnson 1960**: "The Mechanics of Vibration", Cambridge University Press.
//!   Receptances of the uniform beam; the functions F1 to F10.
//! - **Wittrick & Williams 1971**: "A general algorithm for computing natural frequencies of
//!   elastic structures", Quarterly Journal of Mechanics and Applied Mathematics 24, 263-284.
//!   Counts the natural frequencies below a trial frequency, so that none is missed.
//! - **ISO 7626-5:2019**: measurement of mechanical mobility by impact excitation.
//! - **Oppenheim & Schafer**: "Discrete-Time Signal Processing". Kaiser window design,
//!   chirp z-transform.
//! - **Brent 1973**: "Algorithms for Minimization without Derivatives". Root of a function between
//!   two points of opposite sign.
//! - **Bathe**: "Finite Element Procedures", 11.6. Subspace iteration.
//! - **Przemieniecki**: "Theory of Matrix Structural Analysis". Stiffness and consistent mass of
//!   the beam element with shear and rotary inertia.
//! - **Feldman & Cousins 1998**: "Unified approach to the classical statistical analysis of small
//!   signals", Physical Review D 57, 3873-3889. Limits for data that also choose between one end and two.
//! - **Golub & Pereyra 1973**, SIAM Journal on Numerical Analysis 10, 413-432, and **Kaufman 1975**, BIT
//!   15, 49-57. Variable projection: least squares whose linear unknowns are eliminated.
//! - **Hausman 1978**: "Specification tests in econometrics", Econometrica 46, 1251-1271. Tests a precise
//!   estimate of a smaller model for bias, by the less precise one of a larger model.
//! - **DerSimonian & Laird 1986**, Controlled Clinical Trials 7, 177-188, and **Hartung & Knapp 2001**,
//!   Statistics in Medicine 20, 3875-3889. Mean of values that scatter beyond their own uncertainty.
//! - **Madsen, Nielsen & Tingleff 2004**: "Methods for Non-Linear Least Squares Problems",
//!   Technical University of Denmark. Levenberg and Marquardt's method and its damping rule.
//! - **Burnham & Anderson**: "Model Selection and Multimodel Inference". Weights of models after
//!   Akaike's criterion; the criterion under overdispersion.
//! - **Schwarz 1978**: "Estimating the dimension of a model", Annals of Statistics 6, 461-464.
//! - **Abramowitz & Stegun**: "Handbook of Mathematical Functions". Incomplete beta function.
//! - **Guillaume et al. 2003**: "A poly-reference implementation of the least-squares complex
//!   frequency-domain estimator", IMAC XXI. Reduced normal equations of the right matrix fraction.
//! - **Peeters et al. 2004**: "The PolyMAX frequency-domain method: a new standard for modal parameter
//!   estimation?", Shock and Vibration 11, 395-409. Stabilisation diagrams from one factorisation.
//! - **Cauberghe 2004**: "Applied frequency-domain system identification in the field of experimental
//!   and operational modal analysis", thesis, Vrije Universiteit Brussel. Choice of the fixed coefficient.
//! - **Crochiere & Rabiner 1975**: "Optimum FIR digital filter implementations for decimation, interpolation, and
//!   narrow-band filtering", IEEE Transactions on Acoustics, Speech, and Signal Processing 23, 444-456. Decimation in stages.
//! - **Golub & Van Loan**: "Matrix Computations". The shifted QR algorithm.
//! - **Aberth 1973**: "Iteration methods for finding all zeros of a polynomial simultaneously", Mathematics of Computation
//!   27, 339-344, and **Bini 1996**, Numerical Algorithms 13, 179-200. All roots at once, each repelled by the others.
//! - **Henrici 1974**: "Applied and Computational Complex Analysis", volume 1. How many roots lie in the unit circle.
//! - **Parlett 1998**: "The Symmetric Eigenvalue Problem", SIAM. Rayleigh quotient iteration and its third order.
//! - **Lee & Schultz 2004**: "Eigenvalue analysis of Timoshenko beams and axisymmetric Mindlin plates by
//!   the pseudospectral method", Journal of Sound and Vibration 269, 609-621. Frequencies of thick beams.
//! - **Kirchhoff 1879**: "Ueber die Transversalschwingungen eines Stabes von veraenderlichem Querschnitt", Monatsberichte der
//!   Akademie der Wissenschaften zu Berlin, 815-828. Frequencies of a wedge.
//! - **Iwan 1966**: "A distributed-element model for hysteresis and its steady-state dynamic response",
//!   Journal of Applied Mechanics 33, 893-900. Sliders in parallel.
//! - **Box & Hill 1967**: "Discrimination among mechanistic models", Technometrics 9, 57-71. The experiment
//!   whose outcomes the rival models predict furthest apart.
//! - **Kolchinsky & Tracey 2017**: "Estimating mixture entropy with pairwise distances", Entropy 19, 361. Bounds
//!   on the information of a reading about the distribution that it came from.
//! - **Cook & Weisberg 1982**: "Residuals and Influence in Regression", Chapman and Hall. Prediction of readings
//!   by a fit without them.
//! - **Masing 1926**: "Eigenspannungen und Verfestigung beim Messing", Proceedings of the 2nd International
//!   Congress of Applied Mechanics, 332-335. Branches of a hysteresis loop from the first loading.
//! - **Cowper 1966**: "The shear coefficient in Timoshenko's beam theory", Journal of Applied Mechanics 33, 335-340.
//! - **Paule & Mandel 1982**: "Consensus values and weighting factors", Journal of Research of the National Bureau
//!   of Standards 87, 377-385. Scatter between groups beyond their own uncertainties.
//! - **Smyth 2004**: "Linear models and empirical Bayes methods for assessing differential expression in
//!   microarray experiments", Statistical Applications in Genetics and Molecular Biology 3, 3. Variances from
//!   few repeats, drawn towards their common value.
//! - **Hawkins, Qiu & Kang 2003**: "The changepoint model for statistical process control", Journal of Quality
//!   Technology 35, 355-366. A change of the mean at an unknown test, before which nothing is declared healthy.
//! - **Wallace 1959**: "Bounds on normal approximations to Student's and the chi-square distributions", Annals of
//!   Mathematical Statistics 30, 1121-1130. The normal deviate as improbable as a t.
//! - **Kass & Raftery 1995**: "Bayes factors", Journal of the American Statistical Association 90, 773-795.
//! - **Sellke, Bayarri & Berger 2001**: "Calibration of p values for testing precise null hypotheses", The
//!   American Statistician 55, 62-71. The highest odds against a hypothesis that a misfit gives.
//! - **Blake & Zisserman 1987**: "Visual Reconstruction", MIT Press. Graduated non-convexity: a search among
//!   many valleys that begins on a smoothed surface.
