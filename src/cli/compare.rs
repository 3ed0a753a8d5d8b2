use crate::error::Result;
#[derive(clap::Args)]
pub struct CompareArgs {}
pub fn run(_: &CompareArgs) -> Result<()> {
    Ok(())
}
