"""A powered wheelchair that is told where to go, with cameras ahead and range finders all round."""
