//! Quantities with units, as text: "423 mm" becomes 0.423.
